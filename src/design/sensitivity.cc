#include "src/design/sensitivity.h"

#include <algorithm>
#include <cmath>

#include "src/core/collect.h"
#include "src/core/dense.h"
#include "src/core/statistics.h"
#include "src/fit/policy.h"

namespace gapscope {
namespace {

// The scored signals alone. One that stands still over the log is still known to its floor.
std::vector<Recording> ScoredLog(Recording log, const std::vector<double>& floors) {
  std::vector<Recording::Measured> scored;
  for (std::size_t s = 0; s < log.measured.size(); ++s) {
    if (!log.measured[s].spec.scored) continue;
    scored.push_back(std::move(log.measured[s]));
    scored.back().spec.resolution = std::max(scored.back().spec.resolution, floors[s]);
  }
  log.measured = std::move(scored);
  return {std::move(log)};
}

// Residual weights per signal of the experiment.
std::vector<double> WeightsOf(const Recording& log, std::size_t signals, const std::vector<double>& floors,
                              double rows_per_reading) {
  std::vector<double> weights(signals, 0.0);
  for (std::size_t s = 0; s < log.measured.size(); ++s)
    weights[log.measured[s].index] = 1 / (floors[s] * std::sqrt(rows_per_reading));
  return weights;
}

double RowsPerReading(const Recording& log) { return std::max(1.0, kNoiseCorrelation_s / log.timeline.median_step_s); }

FitOptions OptionsOf(const Hypothesis& hypothesis, const ForetoldLog& foretold) {
  const auto& [log, floors, window_s, time_step_s, steps, max_windows, coupling] = foretold;
  const double half_sample_s = 0.5 * log.timeline.median_step_s;
  FitOptions options{.free = hypothesis.model->FreeParameters(),
                     .objective = ObjectiveKind::kFreeRun,
                     .start = WindowStart::kRest,
                     .coupling = coupling,
                     .time_step_s = time_step_s,
                     .steps = steps,
                     .fit_states = false,
                     .shift_range_s = half_sample_s,
                     .weights = WeightsOf(log, hypothesis.model->sources().size(), floors, RowsPerReading(log)),
                     .prior_share = kFitPolicy.known_share,
                     .prior_offset_rad = kFitPolicy.known_offset_rad,
                     .prior_shift_s = half_sample_s,
                     .linear_terms = true};
  if (window_s > 0) {
    options.objective = ObjectiveKind::kWindows;
    options.start = WindowStart::kLog;
    options.window_s = window_s;
    options.max_windows = max_windows;
    options.fit_states = true;
  }
  return options;
}

}  // namespace

double FloorOf(const MeasuredSpec& spec, const std::vector<double>& values) {
  constexpr double kPosition = 5e-4, kSpeed = 0.02, kTorqueShare = 0.01;
  const double quantisation = spec.resolution * spec.resolution / 12;
  switch (spec.kind) {
    case SignalKind::kPosition:
      return std::sqrt(kPosition * kPosition + quantisation);
    case SignalKind::kVelocity:
      return std::sqrt(kSpeed * kSpeed + quantisation);
    case SignalKind::kTorque:
    case SignalKind::kSensor:
    case SignalKind::kOrientation:
      break;
  }
  return std::sqrt(std::pow(std::max(kTorqueShare * LargestMagnitude(values), 1e-9), 2) + quantisation);
}

std::vector<double> FloorsOf(const Recording& predicted) {
  return Collect(predicted.measured, [](const auto& measured) { return FloorOf(measured.spec, measured.values); });
}

ForetoldFit::ForetoldFit(const Hypothesis& hypothesis, const ForetoldLog& foretold)
    : rows_per_reading_(RowsPerReading(foretold.log)),
      model_(hypothesis.model),
      logs_(ScoredLog(foretold.log, foretold.floors)),
      problem_(*model_, logs_, OptionsOf(hypothesis, foretold), hypothesis.values, pool_) {}

std::vector<double> ForetoldFit::Deviations(const std::vector<std::size_t>& wanted) {
  const Linearization at = Linearize(
      problem_, problem_.Start(), {.step = SolveOptions().fine_step, .columns = DifferenceOptions::Columns::kCentral});
  if (!at.valid) return {};
  Eigen::MatrixXd information = at.hessian;
  for (const std::size_t i : wanted) {
    const auto k = static_cast<Eigen::Index>(i);
    const double range = problem_.layout().high[k] - problem_.layout().low[k];
    information(k, k) += 1 / (range * range) - problem_.prior().weight[k];
  }
  const Eigen::VectorXd variances =
      Ldlt(information).Solve(Eigen::MatrixXd::Identity(information.rows(), information.cols())).diagonal();
  return Collect(variances.head(problem_.space().size()),
                 [](double variance) { return std::sqrt(std::max(0.0, variance)); });
}

double ForetoldFit::Misfit(int jacobians, const Deadline& deadline) {
  const SolveResult solved = Solve(
      problem_, problem_.Start(),
      {.max_iterations = jacobians, .tolerance = 0.01, .coarse_step = SolveOptions().fine_step, .deadline = deadline});
  const double squares = 2 * (solved.cost - problem_.prior().Cost(solved.point.y));
  return std::sqrt(std::max(0.0, squares) * rows_per_reading_ / static_cast<double>(problem_.residuals()));
}

}  // namespace gapscope
