#include "replay/scales.h"

#include <algorithm>
#include <cmath>

#include "replay/simulator.h"

namespace gapscope {

ScaleTable EstimateScales(const Model& model, const std::vector<Recording>& recordings) {
  const mjModel& m = model.compiled();
  ScaleTable table;
  Simulator simulator(model, 0);
  const std::vector<double> values = model.Nominal();
  std::vector<Scales> joints(
      m.njnt, {.torque_n_m = 0, .angle_rad = 0, .speed_rad_per_s = 0, .sample_s = 0, .command = 0, .inertia_kg_m2 = 0});
  std::vector<double> buffer, pose(m.nq);
  std::vector<double> steps;
  const auto largest = [](double& value, double candidate) {
    if (std::isfinite(candidate)) value = std::max(value, std::abs(candidate));
  };
  for (const auto& recording : recordings) {
    if (!simulator.SetParameters(values, recording)) continue;
    steps.push_back(recording.timeline.median_step_s);
    mjModel* copy = const_cast<mjModel*>(&simulator.mujoco_model());
    mjData* d = &simulator.data();
    // Follow the measured motion, not a free run that may run off: the torques that the motors would give, and the
    // motion's own inertial torques.
    for (std::size_t row = 0; row < recording.rows(); row += std::max<std::size_t>(1, recording.rows() / 200)) {
      const InitialState state = InitialStateAt(model, recording, row, values);
      mj_resetData(copy, d);
      std::copy(state.qpos.begin(), state.qpos.end(), d->qpos);
      std::copy(state.qvel.begin(), state.qvel.end(), d->qvel);
      for (std::size_t c = 0; c < recording.commands.size(); ++c)
        d->ctrl[model.command_actuators()[c]] = recording.commands[c].values[row];
      mj_forward(copy, d);
      for (int j = 0; j < m.njnt; ++j) {
        if (m.jnt_type[j] != mjJNT_HINGE && m.jnt_type[j] != mjJNT_SLIDE) continue;
        const int dof = m.jnt_dofadr[j];
        largest(joints[j].torque_n_m, d->qfrc_actuator[dof]);
        largest(joints[j].torque_n_m, d->qfrc_passive[dof]);
        largest(joints[j].torque_n_m, d->qfrc_bias[dof]);
        largest(joints[j].angle_rad, d->qpos[m.jnt_qposadr[j]]);
        largest(joints[j].speed_rad_per_s, d->qvel[dof]);
        joints[j].inertia_kg_m2 = DrivenInertia(*copy, j);
      }
    }
  }
  std::sort(steps.begin(), steps.end());
  for (int j = 0; j < m.njnt; ++j) {
    Scales& s = joints[j];
    if (!(s.torque_n_m > 0)) s.torque_n_m = 1;
    if (!(s.angle_rad > 0)) s.angle_rad = 1;
    if (!(s.speed_rad_per_s > 0)) s.speed_rad_per_s = 1;
    if (!steps.empty()) s.sample_s = steps[steps.size() / 2];
    if (const char* name = mj_id2name(&m, mjOBJ_JOINT, j)) table[name] = s;
  }
  for (std::size_t c = 0; c < model.experiment().commands.size(); ++c) {
    const int actuator = mj_name2id(&m, mjOBJ_ACTUATOR, model.experiment().commands[c].actuator.c_str());
    if (m.actuator_trntype[actuator] != mjTRN_JOINT) continue;
    Scales s = joints[m.actuator_trnid[2 * actuator]];
    s.command = 0;
    for (const auto& recording : recordings) {
      for (const double value : recording.commands[c].values) largest(s.command, value);
    }
    if (!(s.command > 0)) s.command = 1;
    table[model.experiment().commands[c].actuator] = s;
  }
  return table;
}

}  // namespace gapscope
