// What goes before a window: the model dragged along the log, so that all that remembers holds what the log says.
#include <algorithm>
#include <cmath>

#include "replay/policy.h"
#include "replay/simulator.h"
#include "src/core/statistics.h"
#include "src/experiment/local_fit.h"

namespace gapscope {
namespace {

constexpr PastPolicy kPast;

// How far a signal's first samples scatter about a smooth curve, by their second differences; at least its resolution.
double ScatterAtStart(const Recording& recording, const Recording::Measured& signal) {
  const auto& v = signal.values;
  double sum = 0, count = 0;
  for (std::size_t row = 2; row < v.size() && recording.time_s[row] - recording.time_s[0] <= kPast.at_once_s; ++row) {
    const double bend = v[row] - 2 * v[row - 1] + v[row - 2];
    if (std::isfinite(bend)) sum += bend * bend, ++count;
  }
  constexpr double kOfWhiteNoise = 6;  // variance of a second difference
  return std::max(signal.spec.resolution, count > 0 ? std::sqrt(sum / count / kOfWhiteNoise) : 0);
}

}  // namespace

bool Simulator::Recall(const Recording& recording, Window window) {
  mj_resetData(mujoco_.get(), data_.get());
  std::fill(held_.begin(), held_.end(), window.begin);
  from_nothing_ = false;
  const bool looks_back = remembers_ || latest_s_ > 0 || stamps_.forces_s < 0;
  if (looks_back && recording.time_s[window.begin] - recording.time_s.front() <= Past()) FindEarlierCommands(recording);
  return PreRoll(recording, window);
}

void Simulator::DragOn(const Recording& recording, std::size_t row, int steps) {
  const double now = recording.time_s[row], next = recording.time_s[row + 1];
  data_->time = now;
  mujoco_->opt.timestep = (next - now) / steps;
  SetCommands(recording, row, now, next);
  for (int step = 0; step < steps; ++step) Step({});
}

void Simulator::Drag(const Recording& recording, Window window, const std::function<void(std::size_t row)>& see) {
  if (!Recall(recording, window)) return;
  mjModel* m = mujoco_.get();
  mjData* d = data_.get();
  const auto& time = recording.time_s;
  const int integrator = m->opt.integrator;
  m->opt.integrator = mjINT_EULER;  // one evaluation a row: the state is the log's anyway
  for (std::size_t row = window.begin; row < window.end; ++row) {
    const double before = row > 0 ? time[row] - time[row - 1] : 0;
    const double after = row + 1 < time.size() ? time[row + 1] - time[row] : before;
    Follow(recording, row);
    d->time = time[row];
    SetMeanCommands(recording, row, time[row] - 0.5 * before, time[row] + 0.5 * after);
    see(row);
    if (remembers_ && row + 1 < window.end) DragOn(recording, row, 1);
  }
  m->opt.integrator = integrator;
  for (auto& warning : d->warning) warning.number = 0;
}

double Simulator::Past() const {
  double past_s = mujoco_->na > 0 && model_.memories().empty() ? kPast.unknown_states_s : kPast.delays_s;
  if (!apart_.empty()) past_s = std::max(past_s, kPast.transmission_s);
  for (const int i : model_.memories())
    past_s = std::max(past_s, std::min(kPast.time_constants * values_[i], kPast.longest_s));
  return std::max({past_s, latest_s_, native_delay_s_ + kPast.delays_s});
}

void Simulator::Follow(const Recording& recording, std::size_t row) {
  for (const auto& measured : recording.measured) {
    const SignalSource& source = model_.source(measured.index);
    if (!TraitsOf(source.kind).gives_angle) continue;
    const LocalFit fit = FitLocally(recording, measured, row, kInitialFitHalfWidth_s);
    data_->qpos[source.qpos] = fit.value - (source.offset >= 0 ? values_[source.offset] : 0);
    data_->qvel[source.dof] = fit.slope;
  }
  const auto nq = static_cast<std::size_t>(mujoco_->nq), nv = static_cast<std::size_t>(mujoco_->nv);
  PlaceFreeBodies(model_, recording, row, values_, {data_->qpos, nq}, {data_->qvel, nv});
}

void Simulator::StandAt(const Recording& recording, std::size_t row) {
  Follow(recording, row);
  const mjModel& m = *mujoco_;
  for (const auto& [joint, of] : model_.mirrored_joints()) {
    data_->qpos[m.jnt_qposadr[joint]] = data_->qpos[m.jnt_qposadr[of]];
    data_->qvel[m.jnt_dofadr[joint]] = data_->qvel[m.jnt_dofadr[of]];
  }
}

// What was commanded before the log began. A mechanism that stands still at the first stamp had been held there: by no
// command, where the model accelerates less under none than under the first one (a step at the first stamp; a held
// weight's first command is what holds it). One that moves was driven by nobody knows what: by the first command. So
// was one that the first command moves at once: it was late before the log began, or is not late.
void Simulator::FindEarlierCommands(const Recording& recording) {
  mjModel* m = mujoco_.get();
  mjData* d = data_.get();
  const auto& actuators = model_.command_actuators();
  for (std::size_t c = 0; c < earlier_.size(); ++c) earlier_[c] = recording.commands[c].values.front();
  bool measured = false, still = true, commanded = false;
  for (const auto& signal : recording.measured) {
    if (!TraitsOf(model_.source(signal.index).kind).gives_angle) continue;
    measured = true;
    still = still && FitLocally(recording, signal, 0, kInitialFitHalfWidth_s).slope == 0;
  }
  for (std::size_t c = 0; c < earlier_.size(); ++c) commanded = commanded || (moves_[c] && earlier_[c] != 0);
  if (!measured || !still || !commanded) return;
  const auto accelerate = [&](bool with_first) {
    StandAt(recording, 0);
    for (std::size_t c = 0; c < earlier_.size(); ++c)
      d->ctrl[actuators[c]] = moves_[c] && !with_first ? 0 : earlier_[c];
    mj_forward(m, d);
    return mju_norm(d->qacc, static_cast<int>(m->nv));
  };
  const double under_none = accelerate(false);
  mj_resetData(m, d);
  from_nothing_ = under_none < kRestShare * accelerate(true) && !MovesAtOnce(recording);
  mj_resetData(m, d);
  for (std::size_t c = 0; c < earlier_.size(); ++c) {
    if (from_nothing_ && moves_[c]) earlier_[c] = 0;
  }
}

// Of the signal that shows it best: as soon as the way of the model's present acceleration is clear of the scatter.
bool Simulator::MovesAtOnce(const Recording& recording) const {
  const auto& time = recording.time_s;
  double clearest = 0, share = 0;
  for (const auto& signal : recording.measured) {
    const SignalSource& source = model_.source(signal.index);
    if (!TraitsOf(source.kind).gives_angle) continue;
    const double acceleration = data_->qacc[source.dof], scatter = ScatterAtStart(recording, signal);
    if (!(std::abs(acceleration) > clearest * scatter)) continue;
    for (std::size_t row = kPast.at_once_rows; row < recording.rows() && time[row] - time[0] <= kPast.at_once_s;
         ++row) {
      const double passed = time[row] - time[0], way = 0.5 * acceleration * passed * passed;
      if (!(std::abs(way) > kPast.at_once_scatters * scatter)) continue;
      clearest = scatter > 0 ? std::abs(acceleration) / scatter : kInfinity;
      share = (signal.values[row] - signal.values[0]) / way;
      break;
    }
  }
  return share >= kRestShare;
}

// Delays, lags and a sagging supply remember what went before: at a window's start the model is dragged along the log
// for a while, so that they hold what the log says and not nothing.
bool Simulator::PreRoll(const Recording& recording, Window window) {
  mjModel* m = mujoco_.get();
  mjData* d = data_.get();
  if (!remembers_ && apart_.empty()) return true;
  const double from = recording.time_s[window.begin] - Past();
  std::size_t first = window.begin;
  while (first > 0 && recording.time_s[first - 1] >= from) --first;
  const int integrator = m->opt.integrator;
  if (apart_.empty()) m->opt.integrator = mjINT_EULER;  // one evaluation a row: the state is the log's anyway
  if (remembers_ && first == 0 && from_nothing_ && recording.rows() > 1) {
    StandAt(recording, 0);
    for (std::size_t c = 0; c < earlier_.size(); ++c) d->ctrl[model_.command_actuators()[c]] = earlier_[c];
    m->opt.timestep = std::min(max_step_s_, recording.time_s[1] - recording.time_s[0]);
    d->time = recording.time_s.front() - m->opt.timestep;
    Step({});
  }
  bool followed = true;
  for (std::size_t row = first; row < window.begin && followed; ++row) {
    // A transmission's motor side is free to move beside the load.
    row == first ? StandAt(recording, row) : Follow(recording, row);
    const double interval = recording.time_s[row + 1] - recording.time_s[row];
    DragOn(recording, row, apart_.empty() ? 1 : StepsOver(interval));
    followed = apart_.empty() || !RunsAway();
  }
  m->opt.integrator = integrator;
  for (auto& warning : d->warning) warning.number = 0;
  return followed;
}

}  // namespace gapscope
