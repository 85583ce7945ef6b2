#include "src/diagnose/block_squares.h"

#include <algorithm>
#include <cmath>

#include "src/core/statistics.h"
#include "src/fit/policy.h"

namespace gapscope {

BlockSquares SquaresByBlock(const std::vector<LogReplay>& logs,
                            const std::function<double(std::size_t, std::size_t)>& weight) {
  BlockSquares sums;
  for (std::size_t l = 0; l < logs.size(); ++l) {
    for (std::size_t s = 0; s < logs[l].signals.size(); ++s) {
      const SignalTrace& trace = logs[l].signals[s];
      const double of_signal = weight(l, s);
      for (std::size_t r = 0; r < logs[l].time_s.size(); ++r) {
        const double error = trace.predicted[r] - trace.measured[r];
        if (std::isfinite(error))
          sums[{l, std::lround(std::floor(logs[l].time_s[r] / kFitPolicy.block_s))}] += of_signal * error * error;
      }
    }
  }
  return sums;
}

BlockSquares NormalisedSquares(const std::vector<LogReplay>& logs) {
  const auto weight = [&](std::size_t l, std::size_t s) {
    const SignalTrace& trace = logs[l].signals[s];
    const auto scored = static_cast<double>(
        std::count_if(logs[l].signals.begin(), logs[l].signals.end(), [](const auto& t) { return t.scored; }));
    const auto rows = static_cast<double>(
        std::count_if(trace.predicted.begin(), trace.predicted.end(), [](double v) { return std::isfinite(v); }));
    const double deviation = MomentsOf(trace.measured).deviation;
    if (!trace.scored || !(deviation > 0) || rows == 0) return 0.0;
    return 1 / (deviation * deviation * rows * scored * static_cast<double>(logs.size()));
  };
  return SquaresByBlock(logs, weight);
}

}  // namespace gapscope
