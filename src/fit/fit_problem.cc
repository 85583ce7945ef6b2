#include "src/fit/fit_problem.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "src/core/collect.h"
#include "src/core/statistics.h"
#include "src/fit/coupling.h"
#include "src/fit/fit_worker.h"
#include "src/fit/policy.h"

namespace gapscope {
namespace {

std::size_t CountResiduals(const std::vector<Recording>& recordings, const FitLayout& layout,
                           const std::vector<FitWindow>& windows) {
  std::size_t count = 0;
  for (const auto& window : windows) {
    for (std::size_t s = 0; s < layout.signals[window.log].size(); ++s) {
      if (!(layout.signals[window.log][s].weight > 0)) continue;
      const auto& measured = recordings[window.log].measured[s].values;
      for (std::size_t row = window.rows.begin + window.first_scored; row < window.rows.end; ++row)
        count += std::isfinite(measured[row]);
    }
  }
  return count;
}

std::vector<Parameter> Bounded(std::vector<Parameter> parameters, const FitOptions& options) {
  for (Parameter& p : parameters) {
    if (const auto given = options.bounds.find(p.name); given != options.bounds.end())
      std::tie(p.low, p.high) = given->second;
  }
  return parameters;
}

std::vector<MovedSignals> MovedByParameters(const Model& model, const FitOptions& options, const SearchSpace& space) {
  return Collect(space.coordinates(), [&](const Coordinate& c) {
    return options.coupling ? options.coupling->OfParameter(space.parameter(c).name, *model.rig()) : MovedSignals();
  });
}

std::vector<MovedSignals> MovedByStates(const Recording& recording, const std::vector<SignalLayout>& signals,
                                        Eigen::Index states, const FitOptions& options) {
  std::vector<MovedSignals> moved(static_cast<std::size_t>(states));
  for (std::size_t s = 0; s < signals.size() && options.coupling; ++s) {
    if (signals[s].joint_state < 0) continue;
    const auto first = static_cast<std::size_t>(signals[s].joint_state);
    moved[first] = moved[first + 1] = options.coupling->OfState(recording.measured[s].index);
  }
  return moved;
}

Eigen::VectorXd StartY(const SearchSpace& space, const FitLayout& layout) {
  Eigen::VectorXd y = Eigen::VectorXd::Zero(layout.low.size());
  y.head(space.size()) = space.ToSearch(space.start());
  return y;
}

}  // namespace

FitProblem::~FitProblem() = default;

FitProblem::Together::Together(std::vector<MovedSignals> of_columns) : moved(std::move(of_columns)) {
  for (const auto& group : ApartGroups(moved))
    groups.push_back(Collect(group, [](std::size_t i) { return static_cast<Eigen::Index>(i); }));
}

FitProblem::FitProblem(const Model& model, const std::vector<Recording>& recordings, FitOptions options,
                       std::vector<double> values, ThreadPool& pool)
    : model_(model),
      recordings_(recordings),
      options_(std::move(options)),
      pool_(pool),
      parameters_(Bounded(model.parameters(), options_)),
      space_(parameters_, options_.free, std::move(values), options_.logarithmic_effects, options_.linear_terms),
      layout_(MakeLayout(model, recordings, options_, space_)),
      windows_(MakeFitWindows(model, recordings, options_, layout_, space_.start())),
      residuals_(CountResiduals(recordings_, layout_, windows_)),
      parameters_together_(MovedByParameters(model, options_, space_)),
      prior_(MakePrior(space_, layout_, options_, StartY(space_, layout_), residuals_, model.parameters())),
      workers_(static_cast<std::size_t>(pool.workers())) {
  for (std::size_t l = 0; l < recordings.size(); ++l)
    states_together_.emplace_back(
        MovedByStates(recordings[l], layout_.signals[l], layout_.state_priors[l].size(), options_));
}

FitPoint FitProblem::Start() const {
  FitPoint point{.y = StartY(space_, layout_), .states = {}};
  for (const auto& window : windows_) point.states.push_back(Eigen::VectorXd::Zero(window.prior.size()));
  return point;
}

FitPoint FitProblem::At(const std::vector<double>& values, FitPoint point) const {
  point.y.head(space_.size()) = space_.ToSearch(values);
  return point;
}

StampShift FitProblem::Stamps(const FitPoint& point) const {
  const auto shift = [&](Eigen::Index at, double fixed) {
    return at < 0 ? fixed : point.y[at] * layout_.shift_scale_s;
  };
  return {.commands_s = shift(layout_.command_shift, options_.stamps.commands_s),
          .forces_s = shift(layout_.force_shift, options_.stamps.forces_s)};
}

double FitProblem::CostOfAnyVariance(double cost, const Eigen::VectorXd& y) const {
  const double surprise = prior_.Surprise(y), data = cost - prior_.scale * surprise;
  const double count = static_cast<double>(std::max<std::size_t>(1, residuals()));
  return data * std::exp(2 * options_.prior_scale * surprise / count);
}

FitProblem::Worker& FitProblem::GetWorker(int index) {
  auto& worker = workers_[static_cast<std::size_t>(index)];
  if (!worker) worker = std::make_unique<Worker>(model_, options_.time_step_s);
  return *worker;
}

std::size_t FitProblem::TakeSteps() {
  std::size_t steps = 0;
  for (const auto& worker : workers_) {
    if (worker) steps += std::exchange(worker->steps, 0);
  }
  return steps;
}

void FitProblem::PlaceStart(Worker& worker, const Place& place) const {
  const auto& [window, point, values, state, stamps, steps] = place;
  const Recording& recording = recordings_[window.log];
  const std::vector<double>& first = space_.start();
  // The fixed start was made with the starting values' offsets; a sensor's delay moves it along the log, a pose's
  // offsets turn and move a body.
  const bool from_log = options_.start == WindowStart::kLog;
  const bool bodies = !model_.free_starts().empty();
  const bool late =
      from_log && std::any_of(model_.sources().begin(), model_.sources().end(), [&](const SignalSource& source) {
        const bool moved = source.offset >= 0 && values[source.offset] != first[source.offset];
        return (source.delay >= 0 && values[source.delay] != first[source.delay]) ||
               (bodies && moved && TraitsOf(source.kind).site == SignalSite::kSensor);
      });
  InitialState& start = worker.start;
  start = late ? InitialStateAt(model_, recording, window.rows.begin, values) : window.start;
  for (std::size_t s = 0; s < recording.measured.size(); ++s) {
    const SignalLayout& signal = layout_.signals[window.log][s];
    const SignalSource& source = model_.source(recording.measured[s].index);
    if (!TraitsOf(source.kind).gives_angle) continue;
    if (source.offset >= 0 && from_log && !late)
      start.qpos[source.qpos] += first[source.offset] - values[source.offset];
    if (from_log) start.qpos[source.qpos] -= layout_.Offset(point.y, window.log, s);
    if (signal.joint_state >= 0) {
      start.qpos[source.qpos] += state[signal.joint_state];
      start.qvel[source.dof] += state[signal.joint_state + 1];
    }
  }
  if (from_log) RemountBodies(worker, place);
  MoveUnseen(worker, place);
  const mjModel& m = model_.compiled();
  const auto& motor_sides = model_.mirrored_joints();
  for (std::size_t i = 0; i < motor_sides.size(); ++i) {
    const auto [joint, from] = motor_sides[i];
    start.qpos[m.jnt_qposadr[joint]] = start.qpos[m.jnt_qposadr[from]];
    start.qvel[m.jnt_dofadr[joint]] = start.qvel[m.jnt_dofadr[from]];
    if (!options_.fit_states) continue;
    const auto beside = state.tail(2 * static_cast<Eigen::Index>(motor_sides.size() - i));
    start.qpos[m.jnt_qposadr[joint]] += beside[0];
    start.qvel[m.jnt_dofadr[joint]] += beside[1];
  }
}

// An orientation's zero offsets are a turn of its sensor, and so of the body where the log says it starts.
void FitProblem::RemountBodies(Worker& worker, const Place& place) const {
  const Recording& recording = recordings_[place.window.log];
  for (const FreeStart& start : model_.free_starts()) {
    const int signal = FindMeasured(recording, start.rotation);
    if (signal < 0) continue;
    Vector3 turn = {};
    for (std::size_t e = 0; e < turn.size(); ++e)
      turn[e] = layout_.Offset(place.point.y, place.window.log, static_cast<std::size_t>(signal) + e);
    Remount(model_, start, place.values, turn, &worker.start);
  }
}

// Along the manifold of poses: quaternions stay unit ones.
void FitProblem::MoveUnseen(Worker& worker, const Place& place) const {
  const UnseenStates& unseen = layout_.unseen[place.window.log];
  if (unseen.dofs.empty()) return;
  Eigen::Index i = unseen.first;
  for (const auto& [dof, signal] : unseen.dofs) {
    worker.way[static_cast<std::size_t>(dof)] = place.state[i++];
    worker.start.qvel[static_cast<std::size_t>(dof)] += place.state[i++];
  }
  mj_integratePos(&model_.compiled(), worker.start.qpos.data(), worker.way.data(), 1);
}

bool FitProblem::Simulate(Worker& worker, const Place& place, std::vector<double>& predicted) const {
  const FitWindow& window = place.window;
  const Recording& recording = recordings_[window.log];
  predicted.resize(window.rows.rows() * recording.measured.size());
  worker.simulator.set_stamps(place.stamps);
  worker.simulator.set_probes(probes_);
  worker.simulator.set_steps(options_.steps == StepKind::kOwn ? place.steps : options_.steps);
  if (!worker.simulator.SetParameters(place.values, recording)) return false;
  PlaceStart(worker, place);
  const RunResult run = worker.simulator.Run(recording, window.rows, worker.start, predicted);
  worker.steps += run.steps;
  return run.outcome == Outcome::kCompleted;
}

void FitProblem::ResidualsOf(const FitWindow& window, const FitPoint& point, const std::vector<double>& predicted,
                             Eigen::VectorXd& residual) const {
  const Recording& recording = recordings_[window.log];
  const std::size_t signals = recording.measured.size(), rows = window.rows.rows();
  residual.resize(window.scored() * static_cast<Eigen::Index>(signals));
  Eigen::Index i = 0;
  for (std::size_t s = 0; s < signals; ++s) {
    const double weight = layout_.signals[window.log][s].weight, offset = layout_.Offset(point.y, window.log, s);
    const double* measured = recording.measured[s].values.data() + window.rows.begin;
    for (std::size_t r = window.first_scored; r < rows; ++r) {
      const double y = measured[r];
      residual[i++] = weight > 0 && std::isfinite(y) ? weight * (predicted[r * signals + s] + offset - y) : 0;
    }
  }
}

double FitProblem::WindowCost(std::size_t window, const Eigen::VectorXd& residual, const Eigen::VectorXd& state) const {
  return 0.5 * (huber_.Sum(residual) + windows_[window].prior.cwiseProduct(state).squaredNorm());
}

Evaluation FitProblem::Evaluate(const FitPoint& point, Keep keep, const WindowMask& mask, StepKind steps) {
  const std::vector<double> values = Values(point);
  const StampShift stamps = Stamps(point);
  std::vector<double> costs(windows_.size());
  Evaluation result{.log_costs = std::vector<double>(recordings_.size(), 0.0)};
  if (keep == Keep::kResiduals) result.residuals.resize(windows_.size());
  pool_.ForEach(windows_.size(), [&](std::size_t w, int index) {
    if (!mask.empty() && !mask[w]) return;
    Worker& worker = GetWorker(index);
    const FitWindow& window = windows_[w];
    if (!Simulate(worker, {window, point, values, point.states[w], stamps, steps}, worker.base)) {
      costs[w] = kInfinity;
      return;
    }
    ResidualsOf(window, point, worker.base, worker.residual);
    costs[w] = WindowCost(w, worker.residual, point.states[w]);
    if (keep == Keep::kResiduals) result.residuals[w] = worker.residual;
  });
  double total = 0;
  for (std::size_t w = 0; w < costs.size(); ++w) {
    total += costs[w];
    result.log_costs[windows_[w].log] += costs[w];
  }
  total += prior_.Cost(point.y);
  result.cost = std::isnan(total) ? kInfinity : total;
  result.work = {.evaluations = 1, .replays = 1, .steps = TakeSteps()};
  return result;
}

std::vector<LogReplay> FitProblem::Predict(const FitPoint& point) {
  std::vector<LogReplay> logs = Collect(recordings_, EmptyTraces);
  const std::vector<double> values = Values(point);
  const StampShift stamps = Stamps(point);
  std::vector<char> failed(windows_.size(), 0);
  pool_.ForEach(windows_.size(), [&](std::size_t w, int index) {
    Worker& worker = GetWorker(index);
    const FitWindow& window = windows_[w];
    if (!Simulate(worker, {window, point, values, point.states[w], stamps}, worker.base)) {
      failed[w] = 1;
      return;
    }
    auto& signals = logs[window.log].signals;
    // Windows share their border row; the later one leaves it to the earlier. What is not scored is not said: a force
    // shows what a start's speed is wrong by, which nothing there holds.
    const std::size_t first = options_.lead_in_s > 0 ? window.first_scored : window.rows.begin == 0 ? 0 : 1;
    for (std::size_t s = 0; s < signals.size(); ++s) {
      const double offset = layout_.Offset(point.y, window.log, s);
      for (std::size_t r = first; r < window.rows.rows(); ++r)
        signals[s].predicted[window.rows.begin + r] = worker.base[r * signals.size() + s] + offset;
    }
  });
  for (std::size_t w = 0; w < windows_.size(); ++w) {
    LogReplay& log = logs[windows_[w].log];
    ++log.windows;
    if (failed[w]) {
      ++log.diverged_windows;
      log.outcome = Outcome::kDiverged;
    }
  }
  return logs;
}

std::vector<FitProblem::FittedStart> FitProblem::FittedStarts(const FitPoint& point) {
  const std::vector<double> values = Values(point);
  Worker& worker = GetWorker(0);
  std::vector<FittedStart> starts;
  for (std::size_t w = 0; w < windows_.size(); ++w) {
    const FitWindow& window = windows_[w];
    PlaceStart(worker, {window, point, values, point.states[w], Stamps(point)});
    FittedStart& start = starts.emplace_back(FittedStart{.state = worker.start, .offsets = {}});
    for (std::size_t s = 0; s < recordings_[window.log].measured.size(); ++s)
      start.offsets.push_back(layout_.Offset(point.y, window.log, s));
  }
  return starts;
}

void FitProblem::WeighStates(const Residuals& residuals) {
  const auto priors = StatePriorsByNoise(model_, recordings_, layout_, windows_, residuals);
  for (std::size_t w = 0; w < windows_.size(); ++w) windows_[w].prior = priors[w];
}

void FitProblem::SetHuberThreshold(const Residuals& residuals) {
  if (options_.huber > 0) huber_.threshold = HuberThreshold(residuals, options_.huber);
}

FitPoint CarryOver(const FitProblem& from, const FitPoint& at, const FitProblem& to,
                   const std::vector<double>& values) {
  FitPoint point = to.Start();
  const std::vector<double> known = from.Values(at);
  std::vector<double> mine = values;
  for (const Coordinate& c : to.space().coordinates()) {
    for (const Coordinate& other : from.space().coordinates()) {
      if (from.space().parameter(other).name == to.space().parameter(c).name)
        mine[c.parameter] = known[other.parameter];
    }
  }
  point.y.head(to.space().size()) = to.space().ToSearch(mine);
  for (const auto& [theirs, ours] : SharedNuisances(from.layout(), to.layout())) point.y[ours] = at.y[theirs];
  // A window that only this one has starts where the log has it, and a motor side that only one of the two has is
  // where the pre-roll leaves it.
  // Both have them in the logs' order.
  const std::vector<FitWindow>& theirs = from.windows();
  auto next = theirs.begin();
  for (std::size_t w = 0; w < point.states.size(); ++w) {
    const FitWindow& window = to.windows()[w];
    const auto same = std::find_if(next, theirs.end(), [&](const FitWindow& other) {
      return other.log == window.log && other.rows.begin == window.rows.begin && other.rows.end == window.rows.end;
    });
    if (same == theirs.end()) continue;
    const Eigen::VectorXd& state = at.states[static_cast<std::size_t>(same - theirs.begin())];
    const Eigen::Index shared = std::min(point.states[w].size(), state.size());
    point.states[w].head(shared) = state.head(shared);
    next = same + 1;
  }
  return point;
}

}  // namespace gapscope
