#include "src/identify/torque.h"

#include <algorithm>
#include <cmath>

#include "replay/initial_state.h"
#include "src/core/statistics.h"
#include "src/model/parameter_writer.h"

namespace gapscope {
namespace {

// Angle, speed, acceleration per joint and grid row, and the commands.
struct GridMotion {
  std::vector<std::vector<double>> q, v, a, commands;

  bool Known(std::size_t row) const {
    for (std::size_t j = 0; j < q.size(); ++j) {
      if (!std::isfinite(q[j][row]) || !std::isfinite(a[j][row])) return false;
    }
    return std::all_of(commands.begin(), commands.end(), [&](const auto& u) { return std::isfinite(u[row]); });
  }
};

// A joint that is not logged is taken to rest at the initial pose.
GridMotion ReadGridMotion(const IdentifyInput& input, const Recording& recording, const SmoothLog& smooth) {
  const mjModel& m = input.model.compiled();
  const std::size_t rows = smooth.size(), joints = static_cast<std::size_t>(m.njnt);
  GridMotion motion{.q = std::vector<std::vector<double>>(joints), .v = motion.q, .a = motion.q, .commands = {}};
  for (int j = 0; j < m.njnt; ++j) {
    const auto* signal = FindSignal(input.model, recording, SignalKind::kPosition, j);
    if (!signal) {
      motion.q[j].assign(rows, m.qpos0[m.jnt_qposadr[j]]);
      motion.v[j].assign(rows, 0);
      motion.a[j].assign(rows, 0);
      continue;
    }
    motion.q[j] = smooth.Sampled(signal->values, 0);
    motion.v[j] = smooth.Sampled(signal->values, 1);
    motion.a[j] = smooth.Sampled(signal->values, 2);
    const SignalSource& source = input.model.source(signal->index);
    if (source.offset >= 0) {
      for (double& angle : motion.q[j]) angle -= input.values[source.offset];
    }
  }
  for (const auto& command : recording.commands) motion.commands.push_back(smooth.Held(command.values));
  return motion;
}

// The model at the recording's values without friction of the joint, and the same with a joint that weighs nothing.
struct BalanceModels {
  ModelPtr whole, light;
  DataPtr data;
};

Result<BalanceModels> MakeBalanceModels(const IdentifyInput& input, const Recording& recording, int joint) {
  const mjModel& base = input.model.compiled();
  BalanceModels models{.whole = ModelPtr(mj_copyModel(nullptr, &base)),
                       .light = ModelPtr(mj_copyModel(nullptr, &base)),
                       .data = DataPtr(mj_makeData(&base))};
  const int dof = base.jnt_dofadr[joint], body = base.jnt_bodyid[joint];
  for (mjModel* m : {models.whole.get(), models.light.get()}) {
    StandHeldBodies(input.model, recording, input.values, m);
    ParameterWriter writer(input.model, m, models.data.get());
    if (!writer.Write(input.values, recording.values))
      return Error{.what = "the parameters make no model", .where = input.model.experiment().path};
    m->dof_damping[dof] = 0;
    m->opt.disableflags |= mjDSBL_CONSTRAINT;  // no dry friction: that is what is sought
  }
  // Next to nothing rather than nothing: MuJoCo factors the inertia matrix on the way.
  constexpr double kNothing = 1e-9;
  mjModel* light = models.light.get();
  light->body_mass[body] *= kNothing;
  for (int i = 0; i < 3; ++i) light->body_inertia[3 * body + i] *= kNothing;
  light->dof_armature[dof] *= kNothing;
  mj_setConst(light, models.data.get());  // inertias of simple bodies are stored
  return models;
}

// The torque as logged, on the grid. A servo's torque jumps with each new target and is logged just before: what moves
// the joint is the mean over the row, half a row's change of the target further.
std::vector<double> MovingTorque(const mjModel& m, const Recording& recording, const Recording::Measured& torque,
                                 const SmoothLog& smooth, int joint, double delay_s) {
  std::vector<double> logged = smooth.Sampled(torque.values, 0);
  for (const auto& command : recording.commands) {
    const int actuator = mj_name2id(&m, mjOBJ_ACTUATOR, command.actuator.c_str());
    if (actuator < 0 || m.actuator_plugin[actuator] >= 0 || m.actuator_trntype[actuator] != mjTRN_JOINT ||
        m.actuator_trnid[2 * actuator] != joint)
      continue;
    const std::vector<double> mean = smooth.Held(command.values, delay_s),
                              seen = smooth.OnGrid(smooth.HeldBefore(command.values, delay_s), 0);
    for (std::size_t i = 0; i < smooth.size(); ++i)
      logged[i] += m.actuator_gainprm[mjNGAIN * actuator] * (mean[i] - seen[i]);
  }
  return logged;
}

}  // namespace

Result<Motion> MotionOf(const IdentifyInput& input, std::size_t log, int joint, const IdentifyOptions& options) {
  const Recording& recording = input.recordings[log];
  const mjModel& base = input.model.compiled();
  const SmoothLog smooth(recording, options);
  const std::size_t rows = smooth.size();
  if (!FindSignal(input.model, recording, SignalKind::kPosition, joint))
    return Error{.what = "the log has no angle of '" + JointName(input.model, joint) + "'",
                 .where = recording.log_path};
  if (rows < 4 * smooth.reach()) {
    return Error{.what = "the log is too short for its low pass",
                 .where = recording.log_path,
                 .actual = std::to_string(static_cast<double>(rows) * smooth.dt_s()) + " s",
                 .cure = "raise --cutoff (now " + std::to_string(smooth.cutoff_hz()) + " Hz)"};
  }
  const GridMotion grid = ReadGridMotion(input, recording, smooth);
  GS_ASSIGN(const BalanceModels models, MakeBalanceModels(input, recording, joint));
  const auto* torque = FindSignal(input.model, recording, SignalKind::kTorque, joint);
  Motion motion{.time_s = {},
                .angle_rad = grid.q[joint],
                .speed_rad_per_s = grid.v[joint],
                .acceleration_rad_per_s2 = grid.a[joint],
                .drive_n_m = std::vector<double>(rows, kNaN),
                .demand_n_m = std::vector<double>(rows, kNaN),
                .others_n_m = std::vector<double>(rows, kNaN),
                .torque_logged = torque != nullptr};
  const std::vector<double> logged =
      torque ? MovingTorque(base, recording, *torque, smooth, joint, options.torque_delay_s) : std::vector<double>();
  const int dof = base.jnt_dofadr[joint];
  std::vector<mjtNum> acceleration(base.nv), inertial(base.nv);
  mjData* d = models.data.get();
  for (std::size_t i = 0; i < rows; ++i) {
    motion.time_s.push_back(smooth.time_s(i));
    if (!grid.Known(i)) continue;
    mj_resetData(models.whole.get(), d);
    for (int j = 0; j < base.njnt; ++j) {
      d->qpos[base.jnt_qposadr[j]] = grid.q[j][i];
      d->qvel[base.jnt_dofadr[j]] = grid.v[j][i];
      acceleration[base.jnt_dofadr[j]] = grid.a[j][i];
    }
    for (std::size_t c = 0; c < grid.commands.size(); ++c)
      d->ctrl[input.model.command_actuators()[c]] = grid.commands[c][i];
    const auto demand = [&](const mjModel* m) {
      mj_fwdPosition(m, d);
      mj_fwdVelocity(m, d);
      mj_mulM(m, d, inertial.data(), acceleration.data());
      return inertial[dof] + d->qfrc_bias[dof] - d->qfrc_passive[dof];
    };
    motion.demand_n_m[i] = demand(models.whole.get());
    motion.others_n_m[i] = demand(models.light.get());
    if (torque) {
      motion.drive_n_m[i] = logged[i];
    } else {
      mj_fwdPosition(models.whole.get(), d);
      mj_fwdVelocity(models.whole.get(), d);
      mj_fwdActuation(models.whole.get(), d);
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
