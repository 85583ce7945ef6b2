#include "src/tune/fit_problem.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "src/tune/journal.h"

namespace gapscope {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// The log's own initial state counts as much as this many samples at the window's start.
constexpr double kStatePriorSamples = 5;
constexpr double kOffsetBound_rad = 0.3;
// Of the sum of squares, per residual and squared range of a coordinate.
constexpr double kAnchor = 1e-8;
constexpr double kBlock_s = 0.5;

}  // namespace

double Coordinate::ToSearch(double value) const { return logarithmic ? std::log(value) : value / scale; }
double Coordinate::ToValue(double search) const { return logarithmic ? std::exp(search) : search * scale; }

// How a signal of a log enters the cost.
struct FitProblem::Scaling {
  double weight = 0;     // 1 / standard deviation of the signal; 0: not scored
  double deviation = 1;
  int offset = -1;       // index in y
  int joint_state = -1;  // index in the window's state of the joint's angle; its speed is the next one
};

struct FitProblem::FitWindow {
  std::size_t log = 0;
  Window rows;
  std::size_t first_scored = 0;  // row in the window
  double weight = 1;
  InitialState start;            // from the log, without offsets
  std::vector<int> qpos, dof;    // per measured joint: its addresses in the state, in the order of the state vector
  Eigen::VectorXd prior;         // weight of each state correction
};

struct FitProblem::Worker {
  Worker(const Model& model, double step) : simulator(model, step) {}
  Simulator simulator;
  InitialState start;
  std::vector<double> values, base, perturbed;
  Eigen::VectorXd residual, other;
  Eigen::MatrixXd jacobian;
};

FitProblem::~FitProblem() = default;

FitProblem::FitProblem(const Model& model, const std::vector<Recording>& recordings, FitOptions options, std::vector<double> values, ThreadPool& pool)
    : model_(model), recordings_(recordings), options_(std::move(options)), values_(std::move(values)), pool_(pool), workers_(pool.workers()), huber_threshold_(kInfinity) {
  std::vector<double> low, high;
  for (const int index : options_.free) {
    const Parameter& p = model.parameters()[index];
    Coordinate c{.parameter = index, .logarithmic = p.low > 0};
    c.scale = c.logarithmic ? 1 : std::max({std::abs(p.nominal), 0.05 * (p.high - p.low), std::numeric_limits<double>::min()});
    c.low = c.ToSearch(p.low);
    c.high = c.ToSearch(p.high);
    coordinates_.push_back(c);
    low.push_back(c.low);
    high.push_back(c.high);
  }
  double step = kInfinity;
  for (std::size_t l = 0; l < recordings.size(); ++l) {
    const Recording& recording = recordings[l];
    step = std::min(step, recording.timeline.median_step_s);
    std::vector<Scaling> scalings(recording.measured.size());
    FitWindow prototype{.log = l};
    std::vector<double> prior;
    for (std::size_t s = 0; s < recording.measured.size(); ++s) {
      const auto& measured = recording.measured[s];
      const Moments moments = MomentsOf(measured.values);
      const double deviation = std::max(moments.deviation, measured.spec.resolution);
      if (!(deviation > 0)) continue;
      scalings[s].deviation = deviation;
      if (measured.spec.scored) scalings[s].weight = options_.weights.empty() ? 1 / (options_.normalization == Normalization::kDeviation ? deviation : std::hypot(deviation, moments.mean)) : options_.weights[measured.index];
      if (measured.spec.kind != SignalKind::kPosition) continue;
      const SignalSource& source = model.source(measured.index);
      if (options_.fit_offsets) {
        scalings[s].offset = static_cast<int>(low.size());
        low.push_back(-kOffsetBound_rad / deviation);
        high.push_back(kOffsetBound_rad / deviation);
      }
      if (options_.fit_states) {
        scalings[s].joint_state = static_cast<int>(2 * prototype.qpos.size());
        prototype.qpos.push_back(source.qpos);
        prototype.dof.push_back(source.dof);
        const double weight = std::sqrt(kStatePriorSamples) * (scalings[s].weight > 0 ? scalings[s].weight : 1 / deviation);
        prior.push_back(weight);
        prior.push_back(weight * kInitialFitHalfWidth_s);
      }
    }
    scaling_.push_back(std::move(scalings));
    prototype.prior = Eigen::Map<Eigen::VectorXd>(prior.data(), static_cast<Eigen::Index>(prior.size()));
    const auto add = [&](ReplayMode mode) {
      const auto rows = MakeWindows(recording, mode, options_.window_s);
      for (std::size_t i = 0; i < rows.size(); ++i) {
        if (options_.fold != Fold::kAll && (i % 3 == 1) != (options_.fold == Fold::kHeldOut)) continue;
        const Window& window = rows[i];
        FitWindow w = prototype;
        w.rows = window;
        w.start = InitialStateAt(model, recording, window.begin, values_);
        const double begin = recording.time_s[window.begin];
        w.first_scored = 1;
        if (mode == ReplayMode::kWindows) {
          while (w.first_scored + 2 < window.rows() && recording.time_s[window.begin + w.first_scored] - begin < options_.lead_in_s) ++w.first_scored;
        }
        windows_.push_back(std::move(w));
      }
    };
    if (options_.objective != Objective::kFreeRun) add(ReplayMode::kWindows);
    if (options_.objective != Objective::kWindows) add(ReplayMode::kFreeRun);
  }
  if (options_.max_windows > 0 && windows_.size() > options_.max_windows) {
    std::vector<FitWindow> kept;
    for (std::size_t i = 0; i < options_.max_windows; ++i) kept.push_back(std::move(windows_[i * windows_.size() / options_.max_windows]));
    windows_ = std::move(kept);
  }
  if (options_.fit_shift && model.command_delay() < 0) {
    // In samples.
    low.push_back(-1);
    high.push_back(1);
    shift_scale_s_ = step;
  }
  low_ = Eigen::Map<Eigen::VectorXd>(low.data(), static_cast<Eigen::Index>(low.size()));
  high_ = Eigen::Map<Eigen::VectorXd>(high.data(), static_cast<Eigen::Index>(high.size()));
  anchor_ = Start().y;
  double scale = 1;
  if (!options_.weights.empty()) {
    // In units of the signals' standard deviations, as without weights.
    scale = 0;
    for (const auto& log : scaling_) {
      for (const auto& scaling : log) scale = std::max(scale, scaling.weight * scaling.deviation);
    }
    scale *= scale;
  }
  anchor_weight_ = kAnchor * scale * static_cast<double>(residuals()) * (high_ - low_).cwiseAbs2().cwiseMax(1e-12).cwiseInverse();
  if (options_.prior_share > 0) {
    // In units of the noise: only meaningful with weights of 1 / noise. An effect's parameters are what is asked for.
    for (std::size_t i = 0; i < coordinates_.size(); ++i) {
      if (model.parameters()[coordinates_[i].parameter].name.find('@') != std::string::npos) continue;
      const auto k = static_cast<Eigen::Index>(i);
      const double deviation = options_.prior_share * (high_[k] - low_[k]);
      anchor_weight_[k] += 1 / (deviation * deviation);
    }
  }
}

double FitProblem::AnchorCost(const FitPoint& point) const { return 0.5 * anchor_weight_.cwiseProduct((point.y - anchor_).cwiseAbs2()).sum(); }

std::size_t FitProblem::windows() const { return windows_.size(); }

std::size_t FitProblem::residuals() const {
  std::size_t count = 0;
  for (const auto& window : windows_) {
    for (const auto& scaling : scaling_[window.log]) {
      if (scaling.weight > 0) count += window.rows.rows() - window.first_scored;
    }
  }
  return count;
}

FitPoint FitProblem::Start() const {
  FitPoint point;
  point.y = Eigen::VectorXd::Zero(low_.size());
  for (std::size_t i = 0; i < coordinates_.size(); ++i) {
    const Coordinate& c = coordinates_[i];
    const double value = values_[c.parameter];
    point.y[i] = std::clamp(c.logarithmic ? c.ToSearch(std::max(value, std::numeric_limits<double>::min())) : c.ToSearch(value), c.low, c.high);
  }
  for (const auto& window : windows_) point.states.push_back(Eigen::VectorXd::Zero(window.prior.size()));
  return point;
}

std::vector<double> FitProblem::Values(const FitPoint& point) const {
  std::vector<double> values = values_;
  for (std::size_t i = 0; i < coordinates_.size(); ++i) values[coordinates_[i].parameter] = coordinates_[i].ToValue(point.y[static_cast<Eigen::Index>(i)]);
  return values;
}

double FitProblem::Offset(const FitPoint& point, std::size_t log, std::size_t signal) const {
  const Scaling& scaling = scaling_[log][signal];
  return scaling.offset < 0 ? 0 : point.y[scaling.offset] * scaling.deviation;
}

double FitProblem::Shift(const FitPoint& point) const { return shift_scale_s_ == 0 ? options_.shift_s : point.y[point.y.size() - 1] * shift_scale_s_; }

FitProblem::Worker& FitProblem::GetWorker(int index) {
  if (!workers_[index]) workers_[index] = std::make_unique<Worker>(model_, options_.time_step_s);
  return *workers_[index];
}

bool FitProblem::Simulate(Worker& worker, const FitWindow& window, const FitPoint& point, const std::vector<double>& values, const Eigen::VectorXd& state, double shift,
                          std::vector<double>& predicted) const {
  const Recording& recording = recordings_[window.log];
  const std::size_t signals = recording.measured.size();
  predicted.resize(window.rows.rows() * signals);
  worker.simulator.set_shift_s(shift);
  if (!worker.simulator.SetParameters(values, recording)) return false;
  worker.start = window.start;
  for (std::size_t s = 0; s < signals; ++s) {
    const Scaling& scaling = scaling_[window.log][s];
    const SignalSource& source = model_.source(recording.measured[s].index);
    if (source.kind != SignalKind::kPosition) continue;
    // The fixed start was made with the starting values' offset parameter.
    if (source.offset >= 0) worker.start.qpos[source.qpos] += values_[source.offset] - values[source.offset];
    worker.start.qpos[source.qpos] -= Offset(point, window.log, s);
    if (scaling.joint_state >= 0) {
      worker.start.qpos[source.qpos] += state[scaling.joint_state];
      worker.start.qvel[source.dof] += state[scaling.joint_state + 1];
    }
  }
  for (const auto& [joint, from] : model_.mirrored_joints()) {
    const mjModel& m = model_.compiled();
    worker.start.qpos[m.jnt_qposadr[joint]] = worker.start.qpos[m.jnt_qposadr[from]];
    worker.start.qvel[m.jnt_dofadr[joint]] = worker.start.qvel[m.jnt_dofadr[from]];
  }
  return worker.simulator.Run(recording, window.rows, worker.start, predicted).outcome == Outcome::kCompleted;
}

void FitProblem::Residuals(const FitWindow& window, const FitPoint& point, const std::vector<double>& predicted, Eigen::VectorXd& residual) const {
  const Recording& recording = recordings_[window.log];
  const std::size_t signals = recording.measured.size(), rows = window.rows.rows();
  residual.resize(static_cast<Eigen::Index>((rows - window.first_scored) * signals));
  Eigen::Index i = 0;
  for (std::size_t s = 0; s < signals; ++s) {
    const double weight = scaling_[window.log][s].weight, offset = Offset(point, window.log, s);
    const double* measured = recording.measured[s].values.data() + window.rows.begin;
    for (std::size_t r = window.first_scored; r < rows; ++r) {
      const double y = measured[r];
      residual[i++] = weight > 0 && std::isfinite(y) ? weight * (predicted[r * signals + s] + offset - y) : 0;
    }
  }
}

double FitProblem::WindowCost(const Eigen::VectorXd& residual, const FitWindow& window, const Eigen::VectorXd& state) const {
  double cost = 0;
  if (huber_threshold_ == kInfinity) {
    cost = residual.squaredNorm();
  } else {
    for (const double r : residual) {
      const double a = std::abs(r);
      cost += a <= huber_threshold_ ? a * a : huber_threshold_ * (2 * a - huber_threshold_);
    }
  }
  return 0.5 * (cost + window.prior.cwiseProduct(state).squaredNorm());
}

double FitProblem::Cost(const FitPoint& point, std::vector<double>* log_costs) {
  ++evaluations_;
  ++replays_;
  if (!journal_) return CostNow(point, log_costs);
  std::vector<double> record;
  if (!journal_->Next(point, &record)) {
    std::vector<double> costs;
    record = {CostNow(point, &costs)};
    record.insert(record.end(), costs.begin(), costs.end());
    journal_->Append(point, record);
  }
  if (log_costs) log_costs->assign(record.begin() + 1, record.end());
  return record[0];
}

double FitProblem::CostNow(const FitPoint& point, std::vector<double>* log_costs) {
  const std::vector<double> values = Values(point);
  const double shift = Shift(point);
  std::vector<double> costs(windows_.size());
  pool_.ForEach(windows_.size(), [&](std::size_t w, int index) {
    Worker& worker = GetWorker(index);
    const FitWindow& window = windows_[w];
    if (!Simulate(worker, window, point, values, point.states[w], shift, worker.base)) {
      costs[w] = kInfinity;
      return;
    }
    Residuals(window, point, worker.base, worker.residual);
    costs[w] = WindowCost(worker.residual, window, point.states[w]);
  });
  double total = 0;
  if (log_costs) log_costs->assign(recordings_.size(), 0.0);
  for (std::size_t w = 0; w < costs.size(); ++w) {
    total += costs[w];
    if (log_costs) (*log_costs)[windows_[w].log] += costs[w];
  }
  total += AnchorCost(point);
  return std::isnan(total) ? kInfinity : total;
}

void FitProblem::UpdateRobustScale(const FitPoint& point) {
  if (!(options_.huber > 0)) return;
  std::vector<std::vector<double>> sizes(windows_.size());
  const std::vector<double> values = Values(point);
  pool_.ForEach(windows_.size(), [&](std::size_t w, int index) {
    Worker& worker = GetWorker(index);
    if (!Simulate(worker, windows_[w], point, values, point.states[w], Shift(point), worker.base)) return;
    Residuals(windows_[w], point, worker.base, worker.residual);
    for (const double r : worker.residual) {
      if (r != 0) sizes[w].push_back(std::abs(r));
    }
  });
  std::vector<double> all;
  for (const auto& part : sizes) all.insert(all.end(), part.begin(), part.end());
  if (all.empty()) return;
  std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2), all.end());
  huber_threshold_ = options_.huber * 1.4826 * all[all.size() / 2];  // the median of |r| as a standard deviation
}

Linearization FitProblem::Linearize(const FitPoint& point, double step, Columns columns) {
  ++evaluations_;
  const std::size_t parameters = columns == Columns::kStates ? 0 : coordinates_.size() * (columns == Columns::kCentral ? 2 : 1);
  replays_ += 1 + parameters + (columns != Columns::kStates && shift_scale_s_ > 0 ? 1 : 0) + (windows_.empty() ? 0 : static_cast<std::size_t>(windows_.front().prior.size()));
  if (!journal_) return LinearizeNow(point, step, columns);
  std::vector<double> record;
  if (journal_->Next(point, &record)) return Unpack(record);
  Linearization result = LinearizeNow(point, step, columns);
  journal_->Append(point, Pack(result));
  return result;
}

Linearization FitProblem::LinearizeNow(const FitPoint& point, double step, Columns columns, Snapshot* keep) {
  const bool all = columns != Columns::kStates;
  const Eigen::Index n = low_.size(), parameters = all ? static_cast<Eigen::Index>(coordinates_.size()) : 0;
  struct Part {
    double cost = 0;
    Eigen::MatrixXd hessian;
    Eigen::VectorXd gradient;
    Eigen::MatrixXd gain;
    Eigen::VectorXd state_step;
    std::vector<std::pair<long, Eigen::VectorXd>> blocks;  // by half second of the log
    bool valid = false;
  };
  std::vector<Part> parts(windows_.size());
  const std::vector<double> values = Values(point);
  const double shift = Shift(point);
  pool_.ForEach(windows_.size(), [&](std::size_t w, int index) {
    Worker& worker = GetWorker(index);
    const FitWindow& window = windows_[w];
    const Eigen::VectorXd& state = point.states[w];
    Part& part = parts[w];
    if (!Simulate(worker, window, point, values, state, shift, worker.base)) return;
    Residuals(window, point, worker.base, worker.residual);
    part.cost = WindowCost(worker.residual, window, state);
    const Eigen::Index m = state.size(), rows = worker.residual.size();
    worker.jacobian.setZero(rows, n + m);
    const std::size_t signals = recordings_[window.log].measured.size();
    const auto difference = [&](Eigen::Index column, double h, bool simulated) {
      if (!simulated) return false;
      Residuals(window, point, worker.perturbed, worker.other);
      worker.jacobian.col(column) = (worker.other - worker.residual) / h;
      return true;
    };
    worker.values = values;
    for (Eigen::Index i = 0; i < parameters; ++i) {
      const Coordinate& c = coordinates_[static_cast<std::size_t>(i)];
      // Towards the inside, so that the step does not leave the bounds; the other way when that cannot be simulated.
      double h = point.y[i] + step <= c.high ? step : -step;
      for (int attempt = 0; attempt < 2; ++attempt, h = -h) {
        worker.values[c.parameter] = c.ToValue(point.y[i] + h);
        if (difference(i, h, Simulate(worker, window, point, worker.values, state, shift, worker.perturbed))) break;
      }
      if (columns == Columns::kCentral && point.y[i] - h >= c.low && point.y[i] - h <= c.high) {
        worker.values[c.parameter] = c.ToValue(point.y[i] - h);
        if (Simulate(worker, window, point, worker.values, state, shift, worker.perturbed)) {
          Residuals(window, point, worker.perturbed, worker.other);
          worker.jacobian.col(i) = 0.5 * (worker.jacobian.col(i) - (worker.other - worker.residual) / h);
        }
      }
      worker.values[c.parameter] = values[c.parameter];
    }
    if (all && shift_scale_s_ > 0) {
      constexpr double kShiftStep = 0.2;  // samples
      difference(n - 1, kShiftStep, Simulate(worker, window, point, values, state, shift + kShiftStep * shift_scale_s_, worker.perturbed));
    }
    Eigen::VectorXd moved = state;
    for (Eigen::Index j = 0; j < m; ++j) {
      const double h = 0.02 / window.prior[j];  // small beside what the log leaves open
      moved[j] += h;
      difference(n + j, h, Simulate(worker, window, point, values, moved, shift, worker.perturbed));
      moved[j] = state[j];
    }
    // An offset moves its own prediction, and the start the other way.
    for (std::size_t s = 0; s < signals; ++s) {
      const Scaling& scaling = scaling_[window.log][s];
      if (scaling.offset < 0 || !all) continue;
      auto column = worker.jacobian.col(scaling.offset);
      if (scaling.joint_state >= 0) {
        column = -scaling.deviation * worker.jacobian.col(n + scaling.joint_state);
      } else {
        FitPoint other = point;
        constexpr double kOffsetStep = 0.01;
        other.y[scaling.offset] += kOffsetStep;
        if (!Simulate(worker, window, other, values, state, shift, worker.perturbed)) continue;
        Residuals(window, point, worker.perturbed, worker.other);
        column = (worker.other - worker.residual) / kOffsetStep;
      }
      const Eigen::Index scored = static_cast<Eigen::Index>(window.rows.rows() - window.first_scored);
      const double* measured = recordings_[window.log].measured[s].values.data() + window.rows.begin + window.first_scored;
      for (Eigen::Index r = 0; r < scored; ++r) {
        if (std::isfinite(measured[r])) column[static_cast<Eigen::Index>(s) * scored + r] += scaling.weight * scaling.deviation;
      }
    }
    // Huber's weights.
    for (Eigen::Index i = 0; i < rows; ++i) {
      if (const double a = std::abs(worker.residual[i]); a > huber_threshold_) {
        const double weight = std::sqrt(huber_threshold_ / a);
        worker.jacobian.row(i) *= weight;
        worker.residual[i] *= weight;
      }
    }
    if (keep) {
      keep->residuals[w] = worker.residual;
      keep->jacobians[w] = worker.jacobian;
    }
    const Eigen::MatrixXd full = worker.jacobian.transpose() * worker.jacobian;
    const Eigen::VectorXd slope = worker.jacobian.transpose() * worker.residual;
    Eigen::MatrixXd own = full.bottomRightCorner(m, m);
    own.diagonal() += window.prior.cwiseAbs2();
    const Eigen::VectorXd own_slope = slope.tail(m) + window.prior.cwiseAbs2().cwiseProduct(state);
    if (m > 0) {
      const Eigen::LDLT<Eigen::MatrixXd> solver(own);
      part.gain = solver.solve(full.bottomLeftCorner(m, n));
      part.state_step = -solver.solve(own_slope);
      part.hessian = full.topLeftCorner(n, n) - full.topRightCorner(n, m) * part.gain;
      part.gradient = slope.head(n) + full.topRightCorner(n, m) * part.state_step;
    } else {
      part.hessian = full;
      part.gradient = slope;
      part.gain.resize(0, n);
      part.state_step.resize(0);
    }
    part.valid = true;
    if (!all) return;
    // The gradient once more in blocks of time, at the states' optimum: rows less what the states take.
    const Eigen::MatrixXd reduced = m > 0 ? Eigen::MatrixXd(worker.jacobian.leftCols(n) - worker.jacobian.rightCols(m) * part.gain) : Eigen::MatrixXd(worker.jacobian.leftCols(n));
    const Eigen::VectorXd after = m > 0 ? Eigen::VectorXd(worker.residual + worker.jacobian.rightCols(m) * part.state_step) : worker.residual;
    const Eigen::Index scored = static_cast<Eigen::Index>(window.rows.rows() - window.first_scored);
    const double* time = recordings_[window.log].time_s.data() + window.rows.begin + window.first_scored;
    for (Eigen::Index begin = 0; begin < scored;) {
      const auto number = static_cast<long>(time[begin] / kBlock_s);
      Eigen::Index end = begin + 1;
      while (end < scored && static_cast<long>(time[end] / kBlock_s) == number) ++end;
      Eigen::VectorXd block = Eigen::VectorXd::Zero(n);
      for (std::size_t s = 0; s < signals; ++s) {
        const Eigen::Index first = static_cast<Eigen::Index>(s) * scored + begin;
        block += reduced.middleRows(first, end - begin).transpose() * after.segment(first, end - begin);
      }
      part.blocks.emplace_back(number, std::move(block));
      begin = end;
    }
  });
  Linearization result;
  result.hessian = Eigen::MatrixXd::Zero(n, n);
  result.gradient = Eigen::VectorXd::Zero(n);
  result.valid = true;
  std::map<std::pair<std::size_t, long>, Eigen::VectorXd> blocks;
  for (std::size_t w = 0; w < parts.size(); ++w) {
    Part& part = parts[w];
    result.valid = result.valid && part.valid;
    if (!part.valid) continue;
    result.cost += part.cost;
    result.hessian += part.hessian;
    result.gradient += part.gradient;
    for (auto& [number, block] : part.blocks) {
      const auto [entry, added] = blocks.try_emplace({windows_[w].log, number}, block);
      if (!added) entry->second += block;
    }
    result.state_gain.push_back(std::move(part.gain));
    result.state_step.push_back(std::move(part.state_step));
  }
  for (auto& [key, block] : blocks) {
    result.block_logs.push_back(static_cast<int>(key.first));
    result.block_gradients.push_back(std::move(block));
  }
  result.cost += AnchorCost(point);
  result.gradient += anchor_weight_.cwiseProduct(point.y - anchor_);
  result.hessian.diagonal() += anchor_weight_;
  return result;
}

Snapshot FitProblem::Capture(const FitPoint& point, double step) {
  Snapshot snapshot;
  snapshot.residuals.resize(windows_.size());
  snapshot.jacobians.resize(windows_.size());
  ++evaluations_;
  snapshot.linearization = LinearizeNow(point, step, Columns::kAll, &snapshot);
  snapshot.valid = snapshot.linearization.valid;
  snapshot.cost = snapshot.linearization.cost;
  return snapshot;
}

ColumnTest FitProblem::TestColumn(const FitPoint& point, const FitProblem& parent, const Snapshot& base) {
  GS_CHECK(parent.windows_.size() == windows_.size());
  const Eigen::Index n = base.linearization.gradient.size();
  struct Part {
    Eigen::VectorXd cross;   // reduced J' c
    double square = 0, slope = 0, raw = 0;
    bool valid = false;
  };
  std::vector<Part> parts(windows_.size());
  const std::vector<double> values = Values(point);
  const double shift = Shift(point);
  pool_.ForEach(windows_.size(), [&](std::size_t w, int index) {
    Worker& worker = GetWorker(index);
    const FitWindow& window = windows_[w];
    if (!Simulate(worker, window, point, values, point.states[w], shift, worker.base)) return;
    Residuals(window, point, worker.base, worker.residual);
    const Eigen::VectorXd column = worker.residual - base.residuals[w];
    const Eigen::MatrixXd& jacobian = base.jacobians[w];
    const Eigen::Index m = jacobian.cols() - n;
    Part& part = parts[w];
    const Eigen::VectorXd all = jacobian.transpose() * column;
    part.raw = part.square = column.squaredNorm();
    part.slope = column.dot(base.residuals[w]);
    part.cross = all.head(n);
    if (m > 0) {
      // The states' own answer: with gain = S^-1 Jx' Jy and step = -S^-1 Jx' r, S^-1 Jx' c needs S once more.
      Eigen::MatrixXd own = jacobian.rightCols(m).transpose() * jacobian.rightCols(m);
      own.diagonal() += window.prior.cwiseAbs2();
      const Eigen::VectorXd answer = own.ldlt().solve(all.tail(m));
      part.square -= all.tail(m).dot(answer);
      part.slope += all.tail(m).dot(base.linearization.state_step[w]);
      part.cross -= base.linearization.state_gain[w].transpose() * all.tail(m);
    }
    part.valid = true;
  });
  ++replays_;
  ColumnTest test;
  Eigen::VectorXd cross = Eigen::VectorXd::Zero(n);
  double square = 0, slope = 0, raw = 0;
  for (const Part& part : parts) {
    if (!part.valid) return test;
    cross += part.cross;
    square += part.square;
    slope += part.slope;
    raw += part.raw;
  }
  test.valid = true;
  if (!(raw > 0)) return test;
  const Eigen::LDLT<Eigen::MatrixXd> solver(base.linearization.hessian);
  const Eigen::VectorXd answer = solver.solve(cross);
  const double left = square - cross.dot(answer), pull = slope - answer.dot(base.linearization.gradient);
  test.absorbed = std::clamp(1 - left / raw, 0.0, 1.0);
  constexpr double kLeast = 1e-6;  // of the column: below it is rounding
  if (!(left > kLeast * raw)) return test;
  test.scale = std::clamp(-pull / left, 0.0, 2.0);
  test.drop = -(test.scale * pull + 0.5 * test.scale * test.scale * left);
  test.dy = -(test.scale * answer);
  return test;
}

FitPoint FitProblem::FromParent(const FitProblem& parent, const FitPoint& parent_point, const std::vector<double>& values, const Eigen::VectorXd& parent_dy) const {
  FitPoint point = Start();
  Eigen::VectorXd y = parent_point.y;
  if (parent_dy.size() == y.size()) y = (y + parent_dy).cwiseMax(parent.low_).cwiseMin(parent.high_);
  for (std::size_t i = 0; i < coordinates_.size(); ++i) {
    const Coordinate& c = coordinates_[i];
    const auto k = static_cast<Eigen::Index>(i);
    point.y[k] = std::clamp(c.logarithmic ? std::log(std::max(values[c.parameter], 1e-300)) : c.ToSearch(values[c.parameter]), c.low, c.high);
    const std::string& name = model_.parameters()[c.parameter].name;
    for (std::size_t j = 0; j < parent.coordinates_.size(); ++j) {
      const Coordinate& other = parent.coordinates_[j];
      if (parent.model_.parameters()[other.parameter].name == name) point.y[k] = std::clamp(c.ToSearch(std::max(other.ToValue(y[static_cast<Eigen::Index>(j)]), c.logarithmic ? 1e-300 : -1e300)), c.low, c.high);
    }
  }
  for (std::size_t l = 0; l < scaling_.size(); ++l) {
    for (std::size_t s = 0; s < scaling_[l].size(); ++s) {
      if (scaling_[l][s].offset >= 0 && parent.scaling_[l][s].offset >= 0) point.y[scaling_[l][s].offset] = y[parent.scaling_[l][s].offset];
    }
  }
  if (shift_scale_s_ > 0 && parent.shift_scale_s_ > 0) point.y[point.y.size() - 1] = y[y.size() - 1];
  GS_CHECK(point.states.size() == parent_point.states.size());
  point.states = parent_point.states;
  return point;
}

std::vector<double> FitProblem::BlockCosts(const FitPoint& point) {
  const std::vector<double> values = Values(point);
  const double shift = Shift(point);
  std::vector<std::vector<double>> parts(windows_.size());
  pool_.ForEach(windows_.size(), [&](std::size_t w, int index) {
    Worker& worker = GetWorker(index);
    const FitWindow& window = windows_[w];
    if (!Simulate(worker, window, point, values, point.states[w], shift, worker.base)) return;
    Residuals(window, point, worker.base, worker.residual);
    const std::size_t signals = recordings_[window.log].measured.size(), scored = window.rows.rows() - window.first_scored;
    const double* time = recordings_[window.log].time_s.data() + window.rows.begin + window.first_scored;
    for (std::size_t begin = 0; begin < scored;) {
      std::size_t end = begin + 1;
      while (end < scored && time[end] - time[begin] < kBlock_s) ++end;
      if (end < scored && time[scored - 1] - time[end] < 0.5 * kBlock_s) end = scored;
      double cost = 0;
      for (std::size_t s = 0; s < signals; ++s) {
        for (std::size_t r = begin; r < end; ++r) {
          const double a = std::abs(worker.residual[static_cast<Eigen::Index>(s * scored + r)]);
          cost += a <= huber_threshold_ ? 0.5 * a * a : huber_threshold_ * (a - 0.5 * huber_threshold_);
        }
      }
      parts[w].push_back(cost);
      begin = end;
    }
  });
  ++replays_;
  std::vector<double> costs;
  for (const auto& part : parts) {
    if (part.empty()) return {};
    costs.insert(costs.end(), part.begin(), part.end());
  }
  return costs;
}

std::vector<LogReplay> FitProblem::Predict(const FitPoint& point) {
  std::vector<LogReplay> logs;
  for (const auto& recording : recordings_) logs.push_back(EmptyTraces(recording));
  const std::vector<double> values = Values(point);
  const double shift = Shift(point);
  std::vector<char> failed(windows_.size(), 0);
  pool_.ForEach(windows_.size(), [&](std::size_t w, int index) {
    Worker& worker = GetWorker(index);
    const FitWindow& window = windows_[w];
    if (!Simulate(worker, window, point, values, point.states[w], shift, worker.base)) {
      failed[w] = 1;
      return;
    }
    auto& signals = logs[window.log].signals;
    // Windows share their border row; the later one leaves it to the earlier.
    for (std::size_t s = 0; s < signals.size(); ++s) {
      const double offset = Offset(point, window.log, s);
      for (std::size_t r = window.rows.begin == 0 ? 0 : 1; r < window.rows.rows(); ++r) signals[s].predicted[window.rows.begin + r] = worker.base[r * signals.size() + s] + offset;
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

FitPoint FitProblem::Move(const FitPoint& point, const Linearization& at, const Eigen::VectorXd& dy) const {
  FitPoint moved{.y = (point.y + dy).cwiseMax(low_).cwiseMin(high_), .states = point.states};
  const Eigen::VectorXd taken = moved.y - point.y;
  for (std::size_t w = 0; w < moved.states.size(); ++w) {
    if (moved.states[w].size() > 0) moved.states[w] += at.state_step[w] - at.state_gain[w] * taken;
  }
  return moved;
}

}  // namespace gapscope
