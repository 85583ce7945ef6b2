#include "src/diagnose/block_errors.h"

#include <algorithm>
#include <cmath>

#include "src/core/statistics.h"
#include "src/fit/policy.h"

namespace gapscope {

BlockErrors ErrorsByBlock(const std::vector<LogReplay>& logs) {
  BlockErrors all;
  for (const LogReplay& log : logs) {
    auto& signals = all.emplace_back();
    for (const SignalTrace& trace : log.signals) {
      SignalErrors errors{.scored = trace.scored, .deviation = MomentsOf(trace.measured).deviation};
      for (std::size_t r = 0; r < log.time_s.size(); ++r) {
        const double error = trace.predicted[r] - trace.measured[r];
        errors.rows += std::isfinite(error);
        if (std::isfinite(error))
          errors.squares[std::lround(std::floor(log.time_s[r] / kFitPolicy.block_s))] += error * error;
      }
      signals.push_back(std::move(errors));
    }
  }
  return all;
}

double SignalErrors::Rms() const {
  double sum = 0;
  for (const auto& [block, square] : squares) sum += square;
  return std::sqrt(sum / rows);
}

BlockSquares SquaresByBlock(const BlockErrors& errors, const std::function<double(std::size_t, std::size_t)>& weight) {
  BlockSquares sums;
  for (std::size_t l = 0; l < errors.size(); ++l) {
    for (std::size_t s = 0; s < errors[l].size(); ++s) {
      const double of_signal = weight(l, s);
      for (const auto& [block, square] : errors[l][s].squares) sums[{l, block}] += of_signal * square;
    }
  }
  return sums;
}

BlockSquares NormalisedSquares(const BlockErrors& errors) {
  const auto weight = [&](std::size_t l, std::size_t s) {
    const SignalErrors& signal = errors[l][s];
    const auto scored =
        static_cast<double>(std::count_if(errors[l].begin(), errors[l].end(), [](const auto& e) { return e.scored; }));
    if (!signal.scored || !(signal.deviation > 0) || signal.rows == 0) return 0.0;
    return 1 / (signal.deviation * signal.deviation * signal.rows * scored * static_cast<double>(errors.size()));
  };
  return SquaresByBlock(errors, weight);
}

std::vector<double> NormalisedErrors(const BlockErrors& errors) {
  std::vector<double> of_logs(errors.size(), 0);
  for (const auto& [block, square] : NormalisedSquares(errors))
    of_logs[block.first] += square * static_cast<double>(errors.size());
  for (double& error : of_logs) error = std::sqrt(error);
  return of_logs;
}

}  // namespace gapscope
