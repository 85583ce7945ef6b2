#include "src/identify/torque.h"

#include <algorithm>
#include <cmath>

#include "src/core/statistics.h"
#include "src/model/parameter_writer.h"

namespace gapscope {
namespace {}  // namespace

Result<Motion> MotionOf(const IdentifyInput& input, std::size_t log, int joint, const IdentifyOptions& options) {
  const Model& model = input.model;
  const Recording& recording = input.recordings[log];
  const mjModel& base = model.compiled();
  const SmoothLog smooth(recording, options);
  const std::size_t rows = smooth.size();
  const auto measured = [&](int j) { return FindSignal(model, recording, SignalKind::kPosition, j); };
  if (!measured(joint))
    return Error{.what = "the log has no angle of '" + JointName(model, joint) + "'", .where = recording.log_path};
  if (rows < 4 * smooth.reach()) {
    return Error{.what = "the log is too short for its low pass",
                 .where = recording.log_path,
                 .actual = std::to_string(static_cast<double>(rows) * smooth.dt_s()) + " s",
                 .cure = "raise --cutoff (now " + std::to_string(smooth.cutoff_hz()) + " Hz)"};
  }
  // Angle, speed, acceleration of every joint; one that is not logged is taken to rest at the initial pose.
  std::vector<std::vector<double>> q(base.njnt), v(base.njnt), a(base.njnt);
  for (int j = 0; j < base.njnt; ++j) {
    if (const auto* signal = measured(j)) {
      q[j] = smooth.Sampled(signal->values, 0);
      v[j] = smooth.Sampled(signal->values, 1);
      a[j] = smooth.Sampled(signal->values, 2);
      const SignalSource& source = model.source(signal->index);
      if (source.offset >= 0) {
        for (double& angle : q[j]) angle -= input.values[source.offset];
      }
    } else {
      q[j].assign(rows, base.qpos0[base.jnt_qposadr[j]]);
      v[j].assign(rows, 0);
      a[j].assign(rows, 0);
    }
  }
  std::vector<std::vector<double>> commands;
  for (const auto& command : recording.commands) commands.push_back(smooth.Held(command.values));
  const Recording::Measured* torque = FindSignal(model, recording, SignalKind::kTorque, joint);

  const ModelPtr copy(mj_copyModel(nullptr, &base)), light(mj_copyModel(nullptr, &base));
  const DataPtr data(mj_makeData(copy.get()));
  const int dof = base.jnt_dofadr[joint], body = base.jnt_bodyid[joint];
  for (mjModel* m : {copy.get(), light.get()}) {
    ParameterWriter writer(model, m, data.get());
    if (!writer.Write(input.values, recording.values))
      return Error{.what = "the parameters make no model", .where = model.experiment().path};
    m->dof_damping[dof] = 0;
    m->opt.disableflags |= mjDSBL_CONSTRAINT;  // no dry friction: that is what is sought
  }
  // Next to nothing rather than nothing: MuJoCo factors the inertia matrix on the way.
  constexpr double kNothing = 1e-9;
  light->body_mass[body] *= kNothing;
  for (int i = 0; i < 3; ++i) light->body_inertia[3 * body + i] *= kNothing;
  light->dof_armature[dof] *= kNothing;
  mj_setConst(light.get(), data.get());  // inertias of simple bodies are stored

  Motion motion;
  motion.torque_logged = torque != nullptr;
  std::vector<double> logged = torque ? smooth.Sampled(torque->values, 0) : std::vector<double>();
  // A servo's torque jumps with each new target and is logged just before: what moves the joint is the mean over the
  // row, half a row's change of the target further.
  for (std::size_t c = 0; torque && c < recording.commands.size(); ++c) {
    const int actuator = mj_name2id(&base, mjOBJ_ACTUATOR, recording.commands[c].actuator.c_str());
    if (actuator < 0 || base.actuator_plugin[actuator] >= 0 || base.actuator_trntype[actuator] != mjTRN_JOINT ||
        base.actuator_trnid[2 * actuator] != joint)
      continue;
    const std::vector<double> mean = smooth.Held(recording.commands[c].values, options.torque_delay_s),
                              seen = smooth.OnGrid(
                                  smooth.HeldBefore(recording.commands[c].values, options.torque_delay_s), 0);
    for (std::size_t i = 0; i < rows; ++i) logged[i] += base.actuator_gainprm[mjNGAIN * actuator] * (mean[i] - seen[i]);
  }
  motion.angle_rad = q[joint], motion.speed_rad_per_s = v[joint], motion.acceleration_rad_per_s2 = a[joint];
  motion.drive_n_m.assign(rows, kNaN);
  motion.demand_n_m.assign(rows, kNaN);
  motion.others_n_m.assign(rows, kNaN);
  std::vector<mjtNum> acceleration(base.nv), inertial(base.nv);
  mjData* d = data.get();
  for (std::size_t i = 0; i < rows; ++i) {
    motion.time_s.push_back(smooth.time_s(i));
    bool known = true;
    mj_resetData(copy.get(), d);
    for (int j = 0; j < base.njnt; ++j) {
      known = known && std::isfinite(q[j][i]) && std::isfinite(a[j][i]);
      d->qpos[base.jnt_qposadr[j]] = q[j][i];
      d->qvel[base.jnt_dofadr[j]] = v[j][i];
      acceleration[base.jnt_dofadr[j]] = a[j][i];
    }
    for (std::size_t c = 0; c < commands.size(); ++c) {
      known = known && std::isfinite(commands[c][i]);
      d->ctrl[model.command_actuators()[c]] = commands[c][i];
    }
    if (!known) continue;
    for (mjModel* m : {copy.get(), light.get()}) {
      mj_fwdPosition(m, d);
      mj_fwdVelocity(m, d);
      mj_mulM(m, d, inertial.data(), acceleration.data());
      (m == copy.get() ? motion.demand_n_m : motion.others_n_m)[i] =
          inertial[dof] + d->qfrc_bias[dof] - d->qfrc_passive[dof];
    }
    if (torque) {
      motion.drive_n_m[i] = logged[i];
    } else {
      mj_fwdPosition(copy.get(), d);
      mj_fwdVelocity(copy.get(), d);
      mj_fwdActuation(copy.get(), d);
      motion.drive_n_m[i] = d->qfrc_actuator[dof];
    }
  }
  return motion;
}

std::vector<char> Sliding(const std::vector<double>& speed, const std::vector<double>& quick, double least,
                          std::size_t reach) {
  const std::size_t rows = speed.size();
  std::vector<char> sliding(rows, 0);
  for (std::size_t i = reach; i + reach < rows; ++i) {
    bool good = std::isfinite(speed[i]) && std::abs(speed[i]) >= least;
    for (std::size_t k = i - reach; good && k <= i + reach; ++k) good = quick[k] * speed[i] > 0;
    sliding[i] = good ? 1 : 0;
  }
  return sliding;
}

}  // namespace gapscope
