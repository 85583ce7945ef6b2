#include "replay/simulator.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "replay/policy.h"
#include "replay/sensors.h"
#include "src/core/statistics.h"
#include "src/experiment/local_fit.h"
#include "src/experiment/orientation.h"
#include "src/plugins/motor/history.h"

namespace gapscope {
namespace {

ModelPtr CopyForReplay(const mjModel& model) {
  ModelPtr copy(mj_copyModel(nullptr, &model));
  // A divergence must be an outcome, never a silent reset; sensors are not read and islands do not pay in models this
  // small.
  copy->opt.disableflags |= mjDSBL_AUTORESET | mjDSBL_SENSOR | mjDSBL_ISLAND;
  return copy;
}

// Mean over [from, to] of a signal that holds values[k] from time[k] to time[k + 1], and `earlier` before the first
// stamp. `row` is a hint that moves with the time.
double MeanHeld(const std::vector<double>& time, const std::vector<double>& values, double earlier, double from,
                double to, std::size_t& row) {
  if (to <= time.front() && from < time.front()) return earlier;
  while (row > 0 && time[row] > from) --row;
  while (row + 1 < time.size() && time[row + 1] <= from) ++row;
  const double begin = std::max(from, time.front());
  double sum = earlier * (begin - from), t = begin;
  if (row + 1 >= time.size() || time[row + 1] >= to)
    return from < begin ? (sum + values[row] * (to - begin)) / (to - from) : values[row];
  std::size_t k = row;
  while (t < to) {
    const double next = k + 1 < time.size() ? std::min(time[k + 1], to) : to;
    sum += values[k] * (next - t);
    t = next;
    if (k + 1 < time.size() && time[k + 1] <= t) ++k;
  }
  return sum / (to - from);
}

// The row of a stamp.
std::size_t RowAt(const std::vector<double>& time_s, double stamp_s) {
  constexpr double kSame = 1e-9;
  const auto at = std::lower_bound(time_s.begin(), time_s.end() - 1, stamp_s - kSame);
  return static_cast<std::size_t>(at - time_s.begin());
}

}  // namespace

Simulator::Simulator(const Model& model, double max_step_s)
    : model_(model),
      mujoco_(CopyForReplay(model.compiled())),
      data_(mj_makeData(mujoco_.get())),
      writer_(model, mujoco_.get(), data_.get()),
      max_step_s_(max_step_s > 0 ? max_step_s : model.compiled().opt.timestep),
      damping_(model, *mujoco_),
      delays_s_(model.command_actuators().size(), 0),
      values_(model.Nominal()),
      earlier_(model.command_actuators().size(), 0),
      held_(model.command_actuators().size(), 0) {
  set_steps(StepKind::kOwn);
  DivideSteps(1);
  // A motor's other inputs (supply, enable) are no commands to move: the first one is.
  for (const auto& command : model.experiment().commands) {
    const int actuator = mj_name2id(mujoco_.get(), mjOBJ_ACTUATOR, command.actuator.c_str()),
              plugin = mujoco_->actuator_plugin[actuator];
    moves_.push_back(plugin < 0 || actuator == 0 || plugin != mujoco_->actuator_plugin[actuator - 1]);
  }
  apart_.resize(model.mirrored_joints().size());
  orientations_.reserve(model.sources().size());
  const int actuators = static_cast<int>(mujoco_->nactuator);
  remembers_ = mujoco_->na > 0 || std::any_of(mujoco_->actuator_plugin, mujoco_->actuator_plugin + actuators,
                                              [](int plugin) { return plugin >= 0; });
  for (int i = 0; i < actuators; ++i) {
    if (mujoco_->actuator_ctrlnum[i] == 0 && mujoco_->actuator_trntype[i] == mjTRN_JOINT) passive_.push_back(i);
    if (mujoco_->actuator_historyadr[i] < 0) continue;
    remembers_ = true;
    native_delay_s_ = std::max(native_delay_s_, mujoco_->actuator_delay[i]);
  }
}

int Simulator::StepsOver(double interval_s) const {
  return std::max(1, static_cast<int>(std::ceil(interval_s / max_step_s_ - 1e-6)));
}

bool Simulator::RunsAway() const {
  const mjModel& m = *mujoco_;
  return std::any_of(data_->qpos, data_->qpos + m.nq, [](double q) { return !(std::abs(q) < kRunaway); }) ||
         std::any_of(data_->qvel, data_->qvel + m.nv, [](double v) { return !(std::abs(v) < 1000 * kRunaway); });
}

bool Simulator::IsSane() const {
  // A command that MuJoCo finds too large is zeroed by it: no replay of that command either.
  const auto warned = [&](int bad) { return data_->warning[bad].number > 0; };
  return !warned(mjWARN_BADQPOS) && !warned(mjWARN_BADQVEL) && !warned(mjWARN_BADQACC) && !warned(mjWARN_BADCTRL) &&
         !RunsAway();
}

void Simulator::set_steps(StepKind steps) {
  const int own = model_.compiled().opt.integrator;
  const bool first_order = own != mjINT_RK4, quick = steps == StepKind::kQuick && model_.HasQuickSteps();
  plain_ = steps == StepKind::kPlain;
  halves_ = first_order && steps == StepKind::kOwn;
  int& integrator = mujoco_->opt.integrator = own;
  if (own == mjINT_EULER && !plain_) integrator = mjINT_IMPLICITFAST;
  if (!first_order && quick) integrator = mjINT_EULER;
}

void Simulator::DivideSteps(int parts) {
  parts_ = parts;
  // Friction rows written for "as stiff as the step allows" (solref -1 -1/h) follow the step that is really used.
  for (int dof = 0; dof < mujoco_->nv; ++dof) {
    mjtNum* solref = mujoco_->dof_solref + mjNREF * dof;
    if (solref[0] == -1) solref[1] = -0.9999 * parts / max_step_s_;
  }
}

bool Simulator::SetParameters(std::span<const double> values, const Recording& recording) {
  std::copy(values.begin(), values.end(), values_.begin());
  for (std::size_t c = 0; c < delays_s_.size(); ++c) {
    const int delay = model_.command_delays()[c];
    delays_s_[c] = stamps_.commands_s + (delay >= 0 ? values_[delay] : 0);
  }
  late_ = std::any_of(delays_s_.begin(), delays_s_.end(), [](double delay_s) { return delay_s != 0; });
  latest_s_ = delays_s_.empty() ? stamps_.commands_s : *std::max_element(delays_s_.begin(), delays_s_.end());
  const bool moved = StandHeldBodies(model_, recording, values, mujoco_.get());
  if (!writer_.Write(values, recording.values)) return false;
  if (moved) mj_setConst(mujoco_.get(), data_.get());
  return true;
}

void Simulator::SetCommands(const Recording& recording, std::size_t row, double from_s, double to_s) {
  const auto& actuators = model_.command_actuators();
  for (std::size_t c = 0; c < actuators.size(); ++c)
    data_->ctrl[actuators[c]] =
        delays_s_[c] == 0 ? recording.commands[c].values[row] : MeanCommand(recording, c, from_s, to_s, held_[c]);
}

void Simulator::SetMeanCommands(const Recording& recording, std::size_t row, double from_s, double to_s) {
  for (std::size_t c = 0; c < delays_s_.size(); ++c) {
    std::size_t near = row;
    data_->ctrl[model_.command_actuators()[c]] = MeanCommand(recording, c, from_s, to_s, near);
  }
}

double Simulator::MeanCommand(const Recording& recording, std::size_t command, double from_s, double to_s,
                              std::size_t& row) const {
  const double delay_s = delays_s_[command];
  return MeanHeld(recording.time_s, recording.commands[command].values, earlier_[command], from_s - delay_s,
                  to_s - delay_s, row);
}

double Simulator::Read(const SignalSource& source) const {
  switch (source.kind) {
    case SignalKind::kPosition:
      return data_->qpos[source.qpos];
    case SignalKind::kVelocity:
      return data_->qvel[source.dof];
    case SignalKind::kSensor:
      return data_->sensordata[source.sensor];
    case SignalKind::kOrientation:
      return 0;  // ReadTurn writes all three
    case SignalKind::kTorque:
      break;
  }
  if (source.estimate >= 0) return data_->plugin_state[source.estimate];
  if (source.dof >= 0) {
    double torque = data_->qfrc_actuator[source.dof];
    for (const int i : passive_) {
      if (mujoco_->jnt_dofadr[mujoco_->actuator_trnid[2 * i]] == source.dof)
        torque -= mujoco_->actuator_gear[6 * i] * data_->actuator_force[mujoco_->actuator_outadr[i]];
    }
    return torque;
  }
  return data_->actuator_force[mujoco_->actuator_outadr[source.actuator]];
}

bool Simulator::Begin(const Recording& recording, Window window, const InitialState& start) {
  const mjModel* m = mujoco_.get();
  mjData* d = data_.get();
  const bool followed = Recall(recording, window);
  // Where a transmission's motor side stands beside its load, which the log does not hold: on which flank of a gap.
  for (std::size_t i = 0; i < apart_.size(); ++i) {
    const auto [joint, of] = model_.mirrored_joints()[i];
    apart_[i] = {followed ? d->qpos[m->jnt_qposadr[joint]] - d->qpos[m->jnt_qposadr[of]] : 0,
                 followed ? d->qvel[m->jnt_dofadr[joint]] - d->qvel[m->jnt_dofadr[of]] : 0};
  }
  std::copy(start.qpos.begin(), start.qpos.end(), d->qpos);
  std::copy(start.qvel.begin(), start.qvel.end(), d->qvel);
  for (std::size_t i = 0; i < apart_.size(); ++i) {
    const auto [joint, of] = model_.mirrored_joints()[i];
    d->qpos[m->jnt_qposadr[joint]] += apart_[i].first;
    d->qvel[m->jnt_dofadr[joint]] += apart_[i].second;
  }
  d->time = recording.time_s[window.begin];
  // Forces cost a pass over the actuators at each stamp, sensors all of a step's work: only when this log has one.
  reads_ = SignalStage::kState;
  orientations_.clear();
  for (std::size_t s = 0; s < recording.measured.size(); ++s) {
    const SignalKind kind = model_.source(recording.measured[s].index).kind;
    reads_ = std::max(reads_, TraitsOf(kind).stage);
    if (kind == SignalKind::kOrientation && recording.measured[s].spec.element == 0) orientations_.push_back(s);
  }
  return followed;
}

void Simulator::ComputeSignals(const Recording& recording, std::size_t row) {
  if (reads_ == SignalStage::kState) return;
  mjModel* m = mujoco_.get();
  mjData* d = data_.get();
  const Recording& logged = recording.finer ? *recording.finer : recording;
  const double stamp = recording.time_s[row] + recording.start_s - logged.start_s;
  const std::size_t at = recording.finer ? RowAt(logged.time_s, stamp) : row;
  const double from = logged.time_s[at > 0 ? at - 1 : 0] + stamps_.forces_s, to = stamp + stamps_.forces_s;
  SetMeanCommands(logged, at, from, to);
  // An actuator's own delay reads what was sent, by the time.
  if (native_delay_s_ > 0) d->time -= 0.5 * (to - from);
  if (reads_ == SignalStage::kSensors) {
    m->opt.disableflags &= ~mjDSBL_SENSOR;
    mj_forward(m, d);
    m->opt.disableflags |= mjDSBL_SENSOR;
  } else {
    mj_fwdPosition(m, d);
    mj_fwdVelocity(m, d);
    mj_fwdActuation(m, d);
  }
  d->time = recording.time_s[row];
}

int Simulator::StepToNext(const Recording& recording, std::size_t row) {
  mjModel* m = mujoco_.get();
  const double now = recording.time_s[row], interval = recording.time_s[row + 1] - now;
  const int steps = parts_ * StepsOver(interval);
  m->opt.timestep = interval / steps;
  if (!late_) SetCommands(recording, row, now, now);
  for (int step = 0; step < steps; ++step) {
    if (late_) SetCommands(recording, row, now + step * m->opt.timestep, now + (step + 1) * m->opt.timestep);
    Step(probes_);
  }
  return steps;
}

double Simulator::Probed(const ProbeTorque& probe) const {
  const double q = data_->qpos[mujoco_->jnt_qposadr[probe.joint]], w = data_->qvel[mujoco_->jnt_dofadr[probe.joint]];
  const double u = probe.actuator >= 0 ? probe.per_command * data_->ctrl[probe.actuator] : 0;
  return probe.amplitude_n_m * std::sin(probe.per_rad * q + probe.s_per_rad * w + u + probe.phase_rad);
}

void Simulator::Apply(std::span<const ProbeTorque> probes) {
  const auto dof_of = [&](const ProbeTorque& probe) { return mujoco_->jnt_dofadr[probe.joint]; };
  for (const ProbeTorque& probe : probes) data_->qfrc_applied[dof_of(probe)] = 0;
  damping_.Apply(data_.get());
  for (const ProbeTorque& probe : probes) data_->qfrc_applied[dof_of(probe)] += Probed(probe);
}

void Simulator::Step(std::span<const ProbeTorque> probes) {
  Apply(probes);
  mj_step(mujoco_.get(), data_.get());
}

RunResult Simulator::Run(const Recording& recording, Window window, const InitialState& start,
                         std::span<double> predicted, std::span<double> qpos) {
  const std::size_t numbers = window.rows() * recording.measured.size();
  GS_CHECK(window.begin < window.end && window.end <= recording.rows() && predicted.size() >= numbers);
  GS_CHECK(qpos.empty() || qpos.size() >= window.rows() * static_cast<std::size_t>(mujoco_->nq));
  RunResult result = RunOnce(recording, window, start, predicted, qpos);
  if (halves_ && result.outcome == Outcome::kCompleted) {
    if (by_whole_.size() < numbers) by_whole_.resize(numbers);
    std::copy_n(predicted.begin(), numbers, by_whole_.begin());
    const std::size_t whole_steps = result.steps;
    DivideSteps(2);
    result = RunOnce(recording, window, start, predicted, qpos);
    DivideSteps(1);
    result.steps += whole_steps;
    for (std::size_t i = 0; i < numbers; ++i) predicted[i] += predicted[i] - by_whole_[i];
  }
  if (mujoco_->opt.integrator != mjINT_RK4) result.steps = (result.steps + 3) / 4;
  ApplySensors(recording, window, predicted);
  return result;
}

RunResult Simulator::RunOnce(const Recording& recording, Window window, const InitialState& start,
                             std::span<double> predicted, std::span<double> qpos) {
  const mjModel* m = mujoco_.get();
  mjData* d = data_.get();
  const std::size_t signals = recording.measured.size(), nq = static_cast<std::size_t>(m->nq);
  if (!plain_) damping_.Hold(mujoco_.get());
  const bool followed = Begin(recording, window, start);
  RunResult result;
  for (std::size_t row = window.begin; row < window.end; ++row) {
    const double now = recording.time_s[row];
    d->time = now;
    if (damping_.held()) Apply(probes_);
    ComputeSignals(recording, row);
    double* out = predicted.data() + (row - window.begin) * signals;
    for (std::size_t s = 0; s < signals; ++s) out[s] = Read(model_.source(recording.measured[s].index));
    for (const std::size_t s : orientations_)
      ReadTurn(recording, row, s, out + s, row > window.begin ? out + s - signals : nullptr);
    if (!qpos.empty())
      std::copy(d->qpos, d->qpos + nq, qpos.begin() + static_cast<std::ptrdiff_t>((row - window.begin) * nq));
    if (row + 1 == window.end) break;

    if (followed) result.steps += static_cast<std::size_t>(StepToNext(recording, row));
    if (!followed || !IsSane()) {
      result.outcome = Outcome::kDiverged;
      result.diverged_at_s = now;
      std::fill(out + signals, predicted.data() + window.rows() * signals, kNaN);
      if (!qpos.empty())
        std::fill(qpos.begin() + static_cast<std::ptrdiff_t>((row - window.begin + 1) * nq), qpos.end(), kNaN);
      break;
    }
  }
  damping_.Release(mujoco_.get());
  return result;
}

void Simulator::ApplySensors(const Recording& recording, Window window, std::span<double> predicted) {
  const std::size_t signals = recording.measured.size(), rows = window.rows();
  const std::span<const double> time(recording.time_s.data() + window.begin, rows);
  for (std::size_t s = 0; s < signals; ++s) {
    const auto& measured = recording.measured[s];
    const SignalSource& source = model_.source(measured.index);
    const double delay = source.delay >= 0 ? values_[source.delay] : 0;
    const bool turns = source.kind == SignalKind::kOrientation;
    const double offset = source.offset >= 0 && !turns ? values_[source.offset] : 0;
    if (rows > 1 && (delay != 0 || source.cutoff >= 0)) {
      if (column_.size() < rows) column_.resize(rows), shaped_.resize(rows);
      std::span<double> column(column_.data(), rows), shaped(shaped_.data(), rows);
      for (std::size_t r = 0; r < rows; ++r) column[r] = predicted[r * signals + s];
      if (source.cutoff >= 0) {
        // What the filter held at the window's start is what was logged there.
        const LocalFit held = FitLocally(recording, measured, window.begin, kInitialFitHalfWidth_s);
        LowPass(time, column,
                {.cutoff_rad_per_s = values_[source.cutoff], .damping_ratio = values_[source.damping_ratio]},
                held.value - offset, held.slope, shaped);
        std::swap(column, shaped);
      }
      if (delay != 0) {
        Delay(time, column, delay, shaped);
        std::swap(column, shaped);
      }
      for (std::size_t r = 0; r < rows; ++r) predicted[r * signals + s] = column[r];
    }
    if (offset != 0) {
      for (std::size_t r = 0; r < rows; ++r) predicted[r * signals + s] += offset;
    }
  }
  for (const std::size_t s : orientations_) CompareTurns(recording, window, s, predicted);
}

void Simulator::ReadTurn(const Recording& recording, std::size_t row, std::size_t signal, double* out,
                         const double* before) {
  const Recording::Measured* turns = recording.measured.data() + signal;
  const double* q = data_->sensordata + model_.source(turns->index).sensor;
  Vector3 near = {};
  for (std::size_t e = 0; e < kTurns; ++e) near[e] = before ? before[e] : turns[e].values[row];
  if (!std::isfinite(near[0] + near[1] + near[2])) near = {};
  const Vector3 turn = NearestTurn(LogRotation(Conjugate(turns->reference) * Quaternion{q[0], q[1], q[2], q[3]}), near);
  std::copy(turn.begin(), turn.end(), out);
}

void Simulator::CompareTurns(const Recording& recording, Window window, std::size_t signal,
                             std::span<double> predicted) {
  const Recording::Measured* turns = recording.measured.data() + signal;
  Vector3 mount = {};
  for (std::size_t e = 0; e < kTurns; ++e) {
    const int offset = model_.source(turns[e].index).offset;
    if (offset >= 0) mount[e] = values_[offset];
  }
  const Quaternion mounted = ExpRotation(mount);
  for (std::size_t r = 0; r < window.rows(); ++r) {
    double* p = predicted.data() + r * recording.measured.size() + signal;
    const Quaternion q = ExpRotation({p[0], p[1], p[2]}) * mounted;
    const std::size_t row = window.begin + r;
    const Vector3 m = {turns[0].values[row], turns[1].values[row], turns[2].values[row]};
    const bool known = std::isfinite(m[0] + m[1] + m[2]);
    const Vector3 turn =
        known ? LogRotation(Conjugate(ExpRotation(m)) * q) : NearestTurn(LogRotation(q), {p[0], p[1], p[2]});
    for (std::size_t e = 0; e < kTurns; ++e) p[e] = known ? m[e] + turn[e] : turn[e];
  }
}

}  // namespace gapscope
