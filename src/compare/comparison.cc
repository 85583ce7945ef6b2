#include "src/compare/comparison.h"

#include <algorithm>
#include <cmath>
#include <numeric>

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

LogComparison CompareLog(const Rig& rig, const LogReplay& log, const Recording& recording) {
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
    if (const int c = rig.CommandOfSignal(trace.signal); c >= 0)
      input.command = recording.commands[static_cast<std::size_t>(c)].values;
    for (auto& share : LocateError(input)) comparison.where.push_back(std::move(share));
  }
  comparison.error = log.outcome == Outcome::kDiverged ? kInfinity : CombinedError(scored);
  return comparison;
}

}  // namespace

Comparison Compare(const Rig& rig, const ReplayResult& result, const std::vector<Recording>& recordings,
                   ThreadPool& pool) {
  Comparison comparison;
  comparison.logs.resize(result.logs.size());
  pool.ForEach(result.logs.size(),
               [&](std::size_t l, int) { comparison.logs[l] = CompareLog(rig, result.logs[l], recordings[l]); });
  double sum = 0;
  for (const auto& log : comparison.logs) sum += log.error * log.error;
  comparison.error = std::sqrt(sum / static_cast<double>(comparison.logs.size()));
  return comparison;
}

std::vector<std::size_t> WorstFirst(std::span<const SignalScore> scores) {
  std::vector<std::size_t> order(scores.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto badness = [&](std::size_t s) { return std::isnan(scores[s].nrmse) ? kInfinity : scores[s].nrmse; };
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return badness(a) > badness(b); });
  return order;
}

std::vector<ConditionShare> TellOfWorst(const LogComparison& log, const TellingOptions& options) {
  std::vector<SignalScore> located;
  for (const SignalScore& score : log.signals) {
    if (std::ranges::find(log.where, score.signal, &ConditionShare::signal) != log.where.end())
      located.push_back(score);
  }
  std::vector<std::size_t> worst = WorstFirst(located);
  worst.resize(std::min(worst.size(), kSignalsTold));
  std::vector<ConditionShare> shares;
  std::ranges::copy_if(log.where, std::back_inserter(shares), [&](const ConditionShare& share) {
    return std::ranges::any_of(worst, [&](std::size_t s) { return located[s].signal == share.signal; });
  });
  return MostTelling(shares, options);
}

}  // namespace gapscope
