#include "src/tune/fit_problem.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "src/compare/noise.h"
#include "src/tune/fit_problem_parts.h"
#include "src/tune/journal.h"

namespace gapscope {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// The log's own initial state counts as much as this many samples at the window's start.
constexpr double kStatePriorSamples = 5;
constexpr double kMotorSidePrior_rad =
    0.02;  // how well the pre-roll knows where a transmission's motor side stands beside its load
constexpr double kOffsetBound_rad = 0.3;
// Of the sum of squares, per residual and squared range of a coordinate.
constexpr double kAnchor = 1e-8;

}  // namespace

FitProblem::~FitProblem() = default;

FitProblem::FitProblem(const Model& model, const std::vector<Recording>& recordings, FitOptions options,
                       std::vector<double> values, ThreadPool& pool)
    : model_(model),
      recordings_(recordings),
      options_(std::move(options)),
      values_(std::move(values)),
      pool_(pool),
      workers_(pool.workers()),
      huber_threshold_(kInfinity) {
  std::vector<double> low, high;
  for (const int index : options_.free) {
    const Parameter& p = model.parameters()[index];
    Coordinate c{.parameter = index, .logarithmic = p.low > 0};
    c.scale = c.logarithmic
                  ? 1
                  : std::max({std::abs(p.nominal), 0.05 * (p.high - p.low), std::numeric_limits<double>::min()});
    c.low = c.ToSearch(p.low);
    c.high = c.ToSearch(p.high);
    const double value = values_[index];
    if (options_.logarithmic_effects && !c.logarithmic && value != 0 && p.owner == Parameter::Owner::kEffect &&
        p.unit.starts_with("N m")) {
      constexpr double kLeast = 1e-3;  // of the value: zero is out of reach, and was not the answer
      c.logarithmic = true;
      c.scale = value > 0 ? 1 : -1;
      c.low = c.ToSearch(kLeast * value);
      c.high = c.ToSearch(value > 0 ? p.high : p.low);
    }
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
      if (measured.spec.scored)
        scalings[s].weight = options_.weights.empty() ? 1 / (options_.normalization == Normalization::kDeviation
                                                                 ? deviation
                                                                 : std::hypot(deviation, moments.mean))
                                                      : options_.weights[measured.index];
      if (measured.spec.kind != SignalKind::kPosition) continue;
      const SignalSource& source = model.source(measured.index);
      if (options_.fit_offsets) {
        scalings[s].offset = static_cast<int>(low.size());
        low.push_back(-kOffsetBound_rad / deviation);
        high.push_back(kOffsetBound_rad / deviation);
      }
      if (options_.fit_states) {
        scalings[s].joint_state = static_cast<int>(prior.size());
        const double weight =
            std::sqrt(kStatePriorSamples) * (scalings[s].weight > 0 ? scalings[s].weight : 1 / deviation);
        prior.push_back(weight);
        prior.push_back(weight * kSpeedPrior_s);
      }
    }
    scaling_.push_back(std::move(scalings));
    // What no sensor shows comes last: each motor side beside its load.
    for (std::size_t i = 0; i < model.mirrored_joints().size() && options_.fit_states; ++i) {
      prior.push_back(1 / kMotorSidePrior_rad);
      prior.push_back(1 / kMotorSidePrior_rad * kSpeedPrior_s);
    }
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
          while (w.first_scored + 2 < window.rows() &&
                 recording.time_s[window.begin + w.first_scored] - begin < options_.lead_in_s)
            ++w.first_scored;
        }
        windows_.push_back(std::move(w));
      }
    };
    if (options_.objective != Objective::kFreeRun) add(ReplayMode::kWindows);
    if (options_.objective != Objective::kWindows) add(ReplayMode::kFreeRun);
  }
  if (options_.max_windows > 0 && windows_.size() > options_.max_windows) {
    std::vector<FitWindow> kept;
    for (std::size_t i = 0; i < options_.max_windows; ++i)
      kept.push_back(std::move(windows_[i * windows_.size() / options_.max_windows]));
    windows_ = std::move(kept);
  }
  if (options_.fit_shift && model.command_delay() < 0) {
    // In samples. A torque is read at a stamp under the command before: it jumps to the next command as soon as
    // commands come early, and no descent gets past that. Where one is scored commands are late or on time.
    bool torque = false;
    for (std::size_t l = 0; l < recordings.size(); ++l) {
      for (std::size_t s = 0; s < recordings[l].measured.size(); ++s)
        torque = torque || (recordings[l].measured[s].spec.kind == SignalKind::kTorque && scaling_[l][s].weight > 0);
    }
    low.push_back(torque ? 0 : -1);
    high.push_back(1);
    shift_scale_s_ = options_.shift_range_s > 0 ? options_.shift_range_s : step;
  }
  low_ = Eigen::Map<Eigen::VectorXd>(low.data(), static_cast<Eigen::Index>(low.size()));
  high_ = Eigen::Map<Eigen::VectorXd>(high.data(), static_cast<Eigen::Index>(high.size()));
  if (options_.linear_terms) CoupleTerms();
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
  anchor_weight_ =
      kAnchor * scale * static_cast<double>(residuals()) * (high_ - low_).cwiseAbs2().cwiseMax(1e-12).cwiseInverse();
  prior_weight_ = Eigen::VectorXd::Zero(low_.size());
  for (std::size_t i = 0; i < coordinates_.size() && options_.prior_share > 0; ++i) {
    // In units of the noise: only meaningful with weights of 1 / noise. An effect's parameters are what is asked for.
    if (model.parameters()[coordinates_[i].parameter].owner != Parameter::Owner::kBase) continue;
    const auto k = static_cast<Eigen::Index>(i);
    const double deviation = options_.prior_share * (high_[k] - low_[k]);
    prior_weight_[k] = 1 / (deviation * deviation);
  }
  for (std::size_t l = 0; l < scaling_.size() && options_.prior_offset_rad > 0; ++l) {
    for (const auto& scaling : scaling_[l]) {
      if (scaling.offset >= 0)
        prior_weight_[scaling.offset] = std::pow(scaling.deviation / options_.prior_offset_rad, 2);
    }
  }
  anchor_weight_ += prior_weight_;
}

void FitProblem::CentrePrior(const std::vector<double>& values) {
  for (std::size_t i = 0; i < coordinates_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (prior_weight_[k] > 0)
      anchor_[k] = std::clamp(coordinates_[i].ToSearch(values[coordinates_[i].parameter]), low_[k], high_[k]);
  }
}

void FitProblem::ScalePrior(double factor) {
  anchor_weight_ += (factor - 1) * prior_weight_;
  prior_weight_ *= factor;
}

double FitProblem::AnchorCost(const FitPoint& point) const {
  return 0.5 * anchor_weight_.cwiseProduct((point.y - anchor_).cwiseAbs2()).sum();
}

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
  point.y.head(static_cast<Eigen::Index>(coordinates_.size())) = ToSearch(values_);
  for (const auto& window : windows_) point.states.push_back(Eigen::VectorXd::Zero(window.prior.size()));
  return point;
}

FitPoint FitProblem::At(const std::vector<double>& values, FitPoint point) const {
  point.y.head(static_cast<Eigen::Index>(coordinates_.size())) = ToSearch(values);
  return point;
}

std::vector<double> FitProblem::Values(const FitPoint& point) const {
  std::vector<double> values = values_;
  for (std::size_t i = 0; i < coordinates_.size(); ++i)
    values[coordinates_[i].parameter] = coordinates_[i].ToValue(point.y[static_cast<Eigen::Index>(i)]);
  for (const Couple& couple : couples_) SetCouple(couple, point.y[couple.size], point.y[couple.other], &values);
  return values;
}

double FitProblem::Offset(const FitPoint& point, std::size_t log, std::size_t signal) const {
  const Scaling& scaling = scaling_[log][signal];
  return scaling.offset < 0 ? 0 : point.y[scaling.offset] * scaling.deviation;
}

double FitProblem::Shift(const FitPoint& point) const {
  return shift_scale_s_ == 0 ? options_.shift_s : point.y[point.y.size() - 1] * shift_scale_s_;
}

FitProblem::Worker& FitProblem::GetWorker(int index) {
  if (!workers_[index]) workers_[index] = std::make_unique<Worker>(model_, options_.time_step_s);
  return *workers_[index];
}

bool FitProblem::Simulate(Worker& worker, const FitWindow& window, const FitPoint& point,
                          const std::vector<double>& values, const Eigen::VectorXd& state, double shift,
                          std::vector<double>& predicted) const {
  const Recording& recording = recordings_[window.log];
  const std::size_t signals = recording.measured.size();
  predicted.resize(window.rows.rows() * signals);
  worker.simulator.set_shift_s(shift);
  if (!worker.simulator.SetParameters(values, recording)) return false;
  // The fixed start was made with the starting values' offsets; a sensor's delay moves it along the log.
  const bool late = std::any_of(model_.sources().begin(), model_.sources().end(), [&](const SignalSource& source) {
    return source.delay >= 0 && values[source.delay] != values_[source.delay];
  });
  worker.start = late ? InitialStateAt(model_, recording, window.rows.begin, values) : window.start;
  for (std::size_t s = 0; s < signals; ++s) {
    const Scaling& scaling = scaling_[window.log][s];
    const SignalSource& source = model_.source(recording.measured[s].index);
    if (source.kind != SignalKind::kPosition) continue;
    if (source.offset >= 0 && !late) worker.start.qpos[source.qpos] += values_[source.offset] - values[source.offset];
    worker.start.qpos[source.qpos] -= Offset(point, window.log, s);
    if (scaling.joint_state >= 0) {
      worker.start.qpos[source.qpos] += state[scaling.joint_state];
      worker.start.qvel[source.dof] += state[scaling.joint_state + 1];
    }
  }
  const auto& motor_sides = model_.mirrored_joints();
  for (std::size_t i = 0; i < motor_sides.size(); ++i) {
    const auto [joint, from] = motor_sides[i];
    const mjModel& m = model_.compiled();
    worker.start.qpos[m.jnt_qposadr[joint]] = worker.start.qpos[m.jnt_qposadr[from]];
    worker.start.qvel[m.jnt_dofadr[joint]] = worker.start.qvel[m.jnt_dofadr[from]];
    if (!options_.fit_states) continue;
    const auto beside = state.tail(2 * static_cast<Eigen::Index>(motor_sides.size() - i));
    worker.start.qpos[m.jnt_qposadr[joint]] += beside[0];
    worker.start.qvel[m.jnt_dofadr[joint]] += beside[1];
  }
  return worker.simulator.Run(recording, window.rows, worker.start, predicted).outcome == Outcome::kCompleted;
}

void FitProblem::Residuals(const FitWindow& window, const FitPoint& point, const std::vector<double>& predicted,
                           Eigen::VectorXd& residual) const {
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

double FitProblem::WindowCost(const Eigen::VectorXd& residual, const FitWindow& window,
                              const Eigen::VectorXd& state) const {
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

double FitProblem::Cost(const FitPoint& point, std::vector<double>* log_costs,
                        std::vector<Eigen::VectorXd>* residuals) {
  ++evaluations_;
  ++replays_;
  if (!journal_) return CostNow(point, log_costs, residuals);
  std::vector<double> record;
  if (!journal_->Next(point, &record)) {
    std::vector<double> costs;
    record = {CostNow(point, &costs, residuals)};
    record.insert(record.end(), costs.begin(), costs.end());
    journal_->Append(point, record);
  }
  if (log_costs) log_costs->assign(record.begin() + 1, record.end());
  return record[0];
}

double FitProblem::CostAndResiduals(const FitPoint& point, std::vector<Eigen::VectorXd>* residuals) {
  ++evaluations_;
  ++replays_;
  return CostNow(point, nullptr, residuals);
}

double FitProblem::TakeBetterStates(FitPoint& point, std::vector<Eigen::VectorXd>& residuals, const FitPoint& other,
                                    std::vector<Eigen::VectorXd>& others) const {
  double total = AnchorCost(point);
  for (std::size_t w = 0; w < windows_.size(); ++w) {
    const auto cost = [&](const FitPoint& at, const std::vector<Eigen::VectorXd>& of) {
      return of[w].size() > 0 ? WindowCost(of[w], windows_[w], at.states[w]) : kInfinity;
    };
    const double here = cost(point, residuals), there = cost(other, others);
    if (there < here) {
      point.states[w] = other.states[w];
      residuals[w] = std::move(others[w]);
    }
    total += std::min(here, there);
  }
  return total;
}

std::vector<Eigen::VectorXd> FitProblem::ResidualsAgain(const FitPoint& point) {
  std::vector<Eigen::VectorXd> residuals;
  CostNow(point, nullptr, &residuals);
  return residuals;
}

double FitProblem::CostNow(const FitPoint& point, std::vector<double>* log_costs,
                           std::vector<Eigen::VectorXd>* residuals) {
  const std::vector<double> values = Values(point);
  const double shift = Shift(point);
  std::vector<double> costs(windows_.size());
  if (residuals) residuals->assign(windows_.size(), {});
  pool_.ForEach(windows_.size(), [&](std::size_t w, int index) {
    Worker& worker = GetWorker(index);
    const FitWindow& window = windows_[w];
    if (!Simulate(worker, window, point, values, point.states[w], shift, worker.base)) {
      costs[w] = kInfinity;
      return;
    }
    Residuals(window, point, worker.base, worker.residual);
    costs[w] = WindowCost(worker.residual, window, point.states[w]);
    if (residuals) (*residuals)[w] = worker.residual;
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

void FitProblem::WeighStates(const FitPoint& point) {
  std::vector<std::vector<double>> squares(scaling_.size());
  std::vector<std::size_t> rows(scaling_.size(), 0);
  const std::vector<Eigen::VectorXd> residuals = ResidualsAgain(point);
  for (std::size_t w = 0; w < windows_.size(); ++w) {
    const FitWindow& window = windows_[w];
    const auto scored = static_cast<Eigen::Index>(window.rows.rows() - window.first_scored);
    squares[window.log].resize(scaling_[window.log].size());
    for (std::size_t s = 0; s < scaling_[window.log].size() && residuals[w].size() > 0; ++s)
      squares[window.log][s] += residuals[w].segment(static_cast<Eigen::Index>(s) * scored, scored).squaredNorm();
    rows[window.log] += static_cast<std::size_t>(scored);
  }
  for (std::size_t l = 0; l < scaling_.size(); ++l) {
    for (std::size_t s = 0; s < scaling_[l].size() && rows[l] > 0; ++s) {
      const auto& measured = recordings_[l].measured[s];
      // Behind a filter a joint is not where the log says.
      if (scaling_[l][s].joint_state < 0 || model_.source(measured.index).cutoff >= 0) continue;
      const double noise =
          EstimateNoise(recordings_[l].time_s, measured.values, {.resolution = measured.spec.resolution}).total_std;
      const double mismatch = std::sqrt(squares[l][s] / static_cast<double>(rows[l]));
      if (!(noise > 0)) continue;
      for (auto& window : windows_) {
        if (window.log != l) continue;
        double* prior = window.prior.data() + scaling_[l][s].joint_state;
        prior[0] = std::max(prior[0], mismatch / noise);
        prior[1] = std::max(prior[1], mismatch / noise * kSpeedPrior_s);
      }
    }
  }
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

FitPoint FitProblem::FromParent(const FitProblem& parent, const FitPoint& parent_point,
                                const std::vector<double>& values, const Eigen::VectorXd& parent_dy) const {
  FitPoint point = Start();
  Eigen::VectorXd y = parent_point.y;
  if (parent_dy.size() == y.size()) y = (y + parent_dy).cwiseMax(parent.low_).cwiseMin(parent.high_);
  const std::vector<double> known = parent.Values({.y = y, .states = {}});
  std::vector<double> mine = values;
  for (const Coordinate& c : coordinates_) {
    for (const Coordinate& other : parent.coordinates_) {
      if (parent.model_.parameters()[other.parameter].name == model_.parameters()[c.parameter].name)
        mine[c.parameter] = known[other.parameter];
    }
  }
  point.y.head(static_cast<Eigen::Index>(coordinates_.size())) = ToSearch(mine);
  for (std::size_t l = 0; l < scaling_.size(); ++l) {
    for (std::size_t s = 0; s < scaling_[l].size(); ++s) {
      if (scaling_[l][s].offset >= 0 && parent.scaling_[l][s].offset >= 0)
        point.y[scaling_[l][s].offset] = y[parent.scaling_[l][s].offset];
    }
  }
  if (shift_scale_s_ > 0 && parent.shift_scale_s_ > 0) point.y[point.y.size() - 1] = y[y.size() - 1];
  GS_CHECK(point.states.size() == parent_point.states.size());
  // A motor side that only one of the two has is where the pre-roll leaves it.
  for (std::size_t w = 0; w < point.states.size(); ++w) {
    const Eigen::Index shared = std::min(point.states[w].size(), parent_point.states[w].size());
    point.states[w].head(shared) = parent_point.states[w].head(shared);
  }
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
    const std::size_t signals = recordings_[window.log].measured.size(),
                      scored = window.rows.rows() - window.first_scored;
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
      for (std::size_t r = window.rows.begin == 0 ? 0 : 1; r < window.rows.rows(); ++r)
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

FitPoint FitProblem::Move(const FitPoint& point, const Linearization& at, const Eigen::VectorXd& dy) const {
  FitPoint moved{.y = (point.y + dy).cwiseMax(low_).cwiseMin(high_), .states = point.states};
  const Eigen::VectorXd taken = moved.y - point.y;
  for (std::size_t w = 0; w < moved.states.size(); ++w) {
    if (moved.states[w].size() > 0) moved.states[w] += at.state_step[w] - at.state_gain[w] * taken;
  }
  return moved;
}

}  // namespace gapscope
