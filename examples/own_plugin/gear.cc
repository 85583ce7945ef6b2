// A MuJoCo plugin of one's own that gapscope can ask about (docs/how-to/candidates.md): a gear that runs out of true.
// gapscope gives each instance the text INSTANCE.joint and, for each parameter, a numeric INSTANCE.PARAMETER that it
// changes between runs. A plugin that reads them on each compute needs nothing else of gapscope.
#include <mujoco/mujoco.h>

#include <cmath>
#include <string>

namespace {

std::string Full(const mjModel* m, int instance, const char* key) {
  return std::string(mj_id2name(m, mjOBJ_PLUGIN, instance)) + "." + key;
}

double Number(const mjModel* m, int instance, const char* key) {
  const int id = mj_name2id(m, mjOBJ_NUMERIC, Full(m, instance, key).c_str());
  return id < 0 ? 0 : m->numeric_data[m->numeric_adr[id]];
}

int Joint(const mjModel* m, int instance) {
  const int id = mj_name2id(m, mjOBJ_TEXT, Full(m, instance, "joint").c_str());
  return id < 0 ? -1 : mj_name2id(m, mjOBJ_JOINT, m->text_data + m->text_adr[id]);
}

}  // namespace

mjPLUGIN_LIB_INIT(acme_gear) {
  mjpPlugin gear;
  mjp_defaultPlugin(&gear);
  gear.name = "acme.gear";
  gear.capabilityflags = mjPLUGIN_PASSIVE;
  gear.nstate = +[](const mjModel*, int) { return 0; };
  gear.init = +[](const mjModel* m, mjData*, int instance) { return Joint(m, instance) < 0 ? -1 : 0; };
  gear.compute = +[](const mjModel* m, mjData* d, int instance, int) {
    const int joint = Joint(m, instance);
    const double angle = d->qpos[m->jnt_qposadr[joint]];
    d->qfrc_passive[m->jnt_dofadr[joint]] +=
        Number(m, instance, "amplitude_n_m") * std::sin(angle - Number(m, instance, "phase_rad"));
  };
  mjp_registerPlugin(&gear);
}
