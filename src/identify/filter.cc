#include "src/identify/filter.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "src/compare/noise.h"
#include "src/core/names.h"
#include "src/core/statistics.h"
#include "src/core/units.h"

namespace gapscope {
namespace {

// Standard deviations of the Gaussian that are summed. Cut at 4.5 the weights of a second derivative would add up to
// -1.4e-4 / sigma^2 instead of zero: times an angle, and an inertia, that looks like a spring.
constexpr double kReach = 6;

// Variance of a sensor's noise behind the filter and a derivative: its density integrated.
double Through(const NoiseFloor& noise, double dt, int order, double cutoff_hz) {
  const double white = std::max(noise.white_std, noise.quantisation_std), coloured = noise.coloured_std,
               tau = coloured > 0 ? noise.correlation_time_s : dt;
  const double step = cutoff_hz / 50, sigma = std::sqrt(std::log(2.0)) / (2 * std::numbers::pi * cutoff_hz);
  double sum = 0;
  for (double hz = 0.5 * step; hz < 4 * cutoff_hz; hz += step) {
    const double w = 2 * std::numbers::pi * hz,
                 density = 2 * white * white * dt + coloured * coloured * 4 * tau / (1 + w * w * tau * tau);
    sum += density * std::pow(w, 2 * order) * std::exp(-w * w * sigma * sigma) * step;
  }
  return sum;
}

}  // namespace

SmoothLog::SmoothLog(const Recording& recording, const IdentifyOptions& options) : recording_(recording) {
  dt_ = recording.timeline.median_step_s;
  const double rate = 1 / dt_;
  cutoff_hz_ = options.cutoff_hz > 0 ? options.cutoff_hz : std::min(15.0, rate / 12);
  // -3 dB where exp(-(2 pi f s)^2 / 2) = 1 / sqrt 2. Below one and a half samples a sampled Gaussian is none any more.
  sigma_ = std::max(std::sqrt(std::log(2.0)) / (2 * std::numbers::pi * cutoff_hz_), 1.5 * dt_);
  cutoff_hz_ = std::sqrt(std::log(2.0)) / (2 * std::numbers::pi * sigma_);
  reach_ = static_cast<std::size_t>(std::ceil(kReach * sigma_ / dt_));
  begin_ = std::max(recording.time_s.front(), options.from_s);
  const double end = options.to_s > 0 ? std::min(options.to_s, recording.time_s.back()) : recording.time_s.back();
  rows_ = end > begin_ ? static_cast<std::size_t>(std::floor((end - begin_) / dt_ + 1e-6)) + 1 : 0;
}

std::vector<double> SmoothLog::GridOf(const std::vector<double>& values, bool held) const {
  const auto& t = recording_.time_s;
  std::vector<double> grid(rows_, kNaN);
  std::size_t k = 0;
  for (std::size_t i = 0; i < rows_; ++i) {
    const double now = time_s(i) + 1e-9 * dt_;
    while (k + 1 < t.size() && t[k + 1] <= now) ++k;
    if (held || k + 1 >= t.size()) {
      grid[i] = values[k];
    } else {
      const double share = std::clamp((time_s(i) - t[k]) / (t[k + 1] - t[k]), 0.0, 1.0);
      grid[i] = share == 0 ? values[k] : values[k] + share * (values[k + 1] - values[k]);
    }
  }
  return grid;
}

std::vector<std::size_t> SmoothLog::Missed() const {
  const auto& t = recording_.time_s;
  std::size_t regular = 0;
  for (std::size_t k = 1; k < t.size(); ++k) regular += std::abs(t[k] - t[k - 1] - dt_) < 0.02 * dt_ ? 1 : 0;
  std::vector<std::size_t> missed;
  if (regular < t.size() * 9 / 10) return missed;
  std::size_t k = 0;
  for (std::size_t i = 0; i < rows_; ++i) {
    while (k + 1 < t.size() && t[k + 1] <= time_s(i) + 0.25 * dt_) ++k;
    if (std::abs(t[k] - time_s(i)) > 0.25 * dt_) missed.push_back(i);
  }
  return missed;
}

std::vector<double> SmoothLog::HeldBefore(const std::vector<double>& values, double late_s) const {
  const auto& t = recording_.time_s;
  std::vector<double> grid(rows_);
  std::size_t k = 0;
  for (std::size_t i = 0; i < rows_; ++i) {
    const double at = time_s(i) - late_s - 1e-6 * dt_;
    while (k + 1 < t.size() && t[k + 1] <= at) ++k;
    grid[i] = values[k];
  }
  return grid;
}

std::vector<double> SmoothLog::OnGrid(const std::vector<double>& grid, int order, double late_s) const {
  const std::ptrdiff_t reach =
      static_cast<std::ptrdiff_t>(reach_) + static_cast<std::ptrdiff_t>(std::ceil(std::abs(late_s) / dt_));
  // weight[k]: of the sample k rows after this one.
  std::vector<double> weights(static_cast<std::size_t>(2 * reach + 1));
  const double scale = dt_ / (sigma_ * std::sqrt(2 * std::numbers::pi));
  for (std::ptrdiff_t k = -reach; k <= reach; ++k) {
    // The filtered signal at t - late is the sum of x(t_j) g(t - late - t_j); u is that argument over sigma.
    const double u = (-late_s - static_cast<double>(k) * dt_) / sigma_, g = scale * std::exp(-0.5 * u * u);
    weights[static_cast<std::size_t>(k + reach)] = order == 0   ? g
                                                   : order == 1 ? -u / sigma_ * g
                                                                : (u * u - 1) / (sigma_ * sigma_) * g;
  }
  // What is left of it: a derivative of a constant is zero, a mean of one is one.
  double sum_of_weights = 0;
  for (const double w : weights) sum_of_weights += w;
  for (double& w : weights) w -= (sum_of_weights - (order == 0 ? 1 : 0)) / static_cast<double>(weights.size());
  std::vector<double> out(grid.size(), kNaN);
  const std::ptrdiff_t rows = static_cast<std::ptrdiff_t>(grid.size());
  for (std::ptrdiff_t i = reach; i < rows - reach; ++i) {
    double sum = 0;
    const double* const x = grid.data() + (i - reach);
    for (std::size_t k = 0; k < weights.size(); ++k) sum += weights[k] * x[k];
    out[static_cast<std::size_t>(i)] = sum;
  }
  return out;
}

std::vector<double> SmoothLog::Sampled(const std::vector<double>& values, int order, double late_s) const {
  return OnGrid(GridOf(values, false), order, late_s);
}

// A held sample stands for the interval after its stamp: its middle is half a step later.
std::vector<double> SmoothLog::Held(const std::vector<double>& values, double late_s) const {
  return OnGrid(GridOf(values, true), 0, late_s + 0.5 * dt_);
}

double NoiseVariance(const IdentifyInput& input, int joint, int order, const IdentifyOptions& options) {
  double sum = 0, logs = 0;
  for (const Recording& recording : input.recordings) {
    const auto* signal = FindSignal(input.model, recording, SignalKind::kPosition, joint);
    if (!signal) continue;
    const NoiseFloor noise =
        EstimateNoise(recording.time_s, signal->values, {.resolution = signal->spec.resolution, .motion_band_hz = 0});
    if (!std::isfinite(noise.total_std)) continue;
    sum += Through(noise, recording.timeline.median_step_s, order, SmoothLog(recording, options).cutoff_hz());
    logs += 1;
  }
  return logs > 0 ? sum / logs : 0;
}

double QuietCutoff(const IdentifyInput& input, int joint, int order, double share, const IdentifyOptions& options) {
  if (options.cutoff_hz > 0) return options.cutoff_hz;
  double cutoff = 0;
  for (const Recording& recording : input.recordings) {
    const auto* signal = FindSignal(input.model, recording, SignalKind::kPosition, joint);
    if (!signal) continue;
    const NoiseFloor noise =
        EstimateNoise(recording.time_s, signal->values, {.resolution = signal->spec.resolution, .motion_band_hz = 0});
    if (!std::isfinite(noise.total_std)) continue;
    const double dt = recording.timeline.median_step_s;
    double own = SmoothLog(recording, options).cutoff_hz();
    for (; own > 0.5; own *= 0.85) {
      IdentifyOptions trial = options;
      trial.cutoff_hz = own;
      const SmoothLog smooth(recording, trial);
      const std::vector<double> derivative = smooth.Sampled(signal->values, order);
      const double total = std::pow(MomentsOf(derivative).deviation, 2);
      if (Through(noise, dt, order, smooth.cutoff_hz()) <= share * total) break;
    }
    cutoff = cutoff > 0 ? std::min(cutoff, own) : own;
  }
  return cutoff;
}

const Recording::Measured* FindSignal(const Model& model, const Recording& recording, SignalKind kind, int joint) {
  for (const auto& measured : recording.measured) {
    const SignalSource& source = model.source(measured.index);
    if (source.kind == kind && source.joint == joint) return &measured;
  }
  return nullptr;
}

std::string JointName(const Model& model, int joint) {
  const char* name = mj_id2name(&model.compiled(), mjOBJ_JOINT, joint);
  return name ? name : "joint " + std::to_string(joint);
}

Result<int> DrivenJoint(const Model& model, const std::string& name) {
  const mjModel& m = model.compiled();
  if (!name.empty()) {
    const int joint = mj_name2id(&m, mjOBJ_JOINT, name.c_str());
    if (joint >= 0) return joint;
    std::vector<std::string> names;
    names.reserve(static_cast<std::size_t>(m.njnt));
    for (int j = 0; j < m.njnt; ++j) names.push_back(JointName(model, j));
    return NoSuch("no such joint", name, names, "--joint");
  }
  for (const auto& command : model.experiment().commands) {
    const int actuator = mj_name2id(&m, mjOBJ_ACTUATOR, command.actuator.c_str());
    if (actuator >= 0 && m.actuator_trntype[actuator] == mjTRN_JOINT) return m.actuator_trnid[2 * actuator];
  }
  return Error{.what = "no command drives a joint", .where = model.experiment().path};
}

Result<std::vector<double>> ExtraColumn(const Model& model, const Recording& recording, const std::string& column,
                                        const std::string& unit) {
  const Experiment& experiment = model.experiment();
  GS_ASSIGN(const Unit parsed, ParseUnit(unit));
  GS_ASSIGN(const Log log, ReadLog(recording.log_path, experiment.read));
  const Column* found = log.Find(column);
  if (!found) {
    return Error{.what = "no column '" + column + "'",
                 .where = recording.log_path,
                 .cure = DidYouMean(column, log.ColumnNames(), "name it by --current-column")};
  }
  return ExtractColumn(log, recording.timeline, *found,
                       {.factor = parsed.factor, .offset = 0, .missing = MissingRepair::kHold}, nullptr);
}

}  // namespace gapscope
