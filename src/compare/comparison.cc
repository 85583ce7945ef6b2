#include "src/compare/comparison.h"

#include <cmath>

#include "src/core/statistics.h"
#include "src/experiment/local_fit.h"

namespace gapscope {
namespace {

// Speed of a joint that is measured, from the log itself: local fits, so that single counts are not reversals.
std::vector<double> SmoothedSpeed(const Recording& recording, const Recording::Measured& measured) {
  std::vector<double> speed(recording.rows());
  const bool given = TraitsOf(measured.spec.kind).gives_speed;
  for (std::size_t row = 0; row < recording.rows(); ++row) {
    const LocalFit fit = FitLocally(recording, measured, row, kInitialFitHalfWidth_s);
    speed[row] = given ? fit.value : fit.slope;
  }
  return speed;
}

LogComparison CompareLog(const LogReplay& log, const Recording& recording) {
  LogComparison comparison{.log_path = log.log_path};
  std::vector<SignalScore> scored;
  for (std::size_t s = 0; s < log.signals.size(); ++s) {
    const SignalTrace& trace = log.signals[s];
    comparison.signals.push_back(
        ScoreSignal(trace.signal, log.time_s, trace.measured, trace.predicted, trace.resolution));
    if (!trace.scored) continue;
    scored.push_back(comparison.signals.back());
    ConditionInput input{
        .signal = trace.signal, .time_s = log.time_s, .measured = trace.measured, .predicted = trace.predicted};
    std::vector<double> speed;
    const SignalTraits& traits = TraitsOf(trace.kind);
    if (traits.gives_angle || traits.gives_speed) {
      speed = SmoothedSpeed(recording, recording.measured[s]);
      input.speed = speed;
    }
    if (traits.gives_angle) input.angle = trace.measured;
    if (!recording.commands.empty()) input.command = recording.commands.front().values;
    for (auto& share : LocateError(input)) comparison.where.push_back(std::move(share));
  }
  comparison.error = log.outcome == Outcome::kDiverged ? kInfinity : CombinedError(scored);
  return comparison;
}

}  // namespace

Comparison Compare(const ReplayResult& result, const std::vector<Recording>& recordings, ThreadPool& pool) {
  Comparison comparison;
  comparison.logs.resize(result.logs.size());
  pool.ForEach(result.logs.size(),
               [&](std::size_t l, int) { comparison.logs[l] = CompareLog(result.logs[l], recordings[l]); });
  double sum = 0;
  for (const auto& log : comparison.logs) sum += log.error * log.error;
  comparison.error = std::sqrt(sum / static_cast<double>(comparison.logs.size()));
  return comparison;
}

}  // namespace gapscope
