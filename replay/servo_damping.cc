#include "replay/servo_damping.h"

namespace gapscope {

ServoDamping::ServoDamping(const Model& model, const mjModel& mujoco) {
  const mjModel &m = mujoco, &before = model.rig()->compiled();
  if (before.opt.integrator == mjINT_RK4) return;
  for (int i = 0; i < m.nactuator; ++i) {
    const char* name = mj_id2name(&m, mjOBJ_ACTUATOR, i);
    const int own = name ? mj_name2id(&before, mjOBJ_ACTUATOR, name) : -1;
    const bool replaced = own >= 0 && m.actuator_plugin[i] >= 0 && before.actuator_plugin[own] < 0;
    if (!replaced || m.actuator_trntype[i] != mjTRN_JOINT || before.actuator_biastype[own] != mjBIAS_AFFINE) continue;
    const double gear = before.actuator_gear[6 * own], per_speed = before.actuator_biasprm[mjNBIAS * own + 2];
    if (per_speed < 0)
      servos_.push_back({.dof = m.jnt_dofadr[m.actuator_trnid[2 * i]], .damping = -gear * gear * per_speed});
  }
}

void ServoDamping::Hold(mjModel* m) {
  if (held_) return;
  for (Servo& servo : servos_) {
    servo.of_joint = m->dof_damping[servo.dof];
    m->dof_damping[servo.dof] += servo.damping;
  }
  held_ = !servos_.empty();
}

void ServoDamping::Release(mjModel* m) {
  if (!held_) return;
  for (const Servo& servo : servos_) m->dof_damping[servo.dof] = servo.of_joint;
  held_ = false;
}

void ServoDamping::Apply(mjData* d) const {
  if (!held_) return;
  for (const Servo& servo : servos_) d->qfrc_applied[servo.dof] = servo.damping * d->qvel[servo.dof];
}

}  // namespace gapscope
