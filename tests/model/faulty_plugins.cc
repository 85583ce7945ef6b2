// Plugins that a run must survive, and one that acts at its neutral values.
#include <mujoco/mujoco.h>

#include <atomic>
#include <csignal>
#include <string>

namespace {

mjpPlugin Plugin(const char* name, void (*compute)(const mjModel*, mjData*, int, int)) {
  mjpPlugin plugin;
  mjp_defaultPlugin(&plugin);
  plugin.name = name;
  plugin.capabilityflags = mjPLUGIN_PASSIVE;
  plugin.nstate = +[](const mjModel*, int) { return 0; };
  plugin.init = +[](const mjModel*, mjData*, int) { return 0; };
  plugin.compute = compute;
  return plugin;
}

void Idle(const mjModel*, mjData*, int, int) {}

// A spring about zero by the numeric INSTANCE.size, which crashes long after a run has tried it.
void CrashLate(const mjModel* m, mjData* d, int instance, int) {
  constexpr int kLate = 20000;
  static std::atomic<int> calls = 0;
  if (++calls > kLate) raise(SIGSEGV);
  const std::string name = mj_id2name(m, mjOBJ_PLUGIN, instance);
  const int size = mj_name2id(m, mjOBJ_NUMERIC, (name + ".size").c_str());
  d->qfrc_passive[0] -= m->numeric_data[m->numeric_adr[size]] * d->qpos[0];
}

}  // namespace

mjPLUGIN_LIB_INIT(faulty) {
  const mjpPlugin crashes = Plugin("faulty.crashes", +[](const mjModel*, mjData*, int, int) { raise(SIGSEGV); });
  mjp_registerPlugin(&crashes);
  const mjpPlugin fatal =
      Plugin("faulty.fatal", +[](const mjModel*, mjData*, int, int) { mju_error("the table is empty"); });
  mjp_registerPlugin(&fatal);
  const mjpPlugin late = Plugin("faulty.late", CrashLate);
  mjp_registerPlugin(&late);
  mjpPlugin refuses = Plugin("faulty.refuses", Idle);
  refuses.init = +[](const mjModel*, mjData*, int) { return -1; };
  mjp_registerPlugin(&refuses);
  const mjpPlugin idle = Plugin("faulty.idle", Idle);
  mjp_registerPlugin(&idle);
  mjpPlugin drives = Plugin("faulty.drives", Idle);
  drives.capabilityflags = mjPLUGIN_ACTUATOR;
  mjp_registerPlugin(&drives);
  const mjpPlugin pushes =
      Plugin("faulty.pushes", +[](const mjModel*, mjData* d, int, int) { d->qfrc_passive[0] += 1; });
  mjp_registerPlugin(&pushes);
}
