// Plugins that a run must survive, and one that acts at its neutral values.
#include <mujoco/mujoco.h>

#include <csignal>

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

}  // namespace

mjPLUGIN_LIB_INIT(faulty) {
  const mjpPlugin crashes = Plugin("faulty.crashes", +[](const mjModel*, mjData*, int, int) { raise(SIGSEGV); });
  mjp_registerPlugin(&crashes);
  const mjpPlugin fatal =
      Plugin("faulty.fatal", +[](const mjModel*, mjData*, int, int) { mju_error("the table is empty"); });
  mjp_registerPlugin(&fatal);
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
