#include "src/report/signal_table.h"

#include <fmt/core.h>

#include <algorithm>
#include <numeric>

#include "src/compare/comparison.h"

namespace gapscope {

constexpr std::size_t kMostLines = 8;

std::vector<std::size_t> SignalsInTable(std::span<const SignalScore> scores) {
  std::vector<std::size_t> shown;
  if (scores.size() <= kMostLines) {
    shown.resize(scores.size());
    std::iota(shown.begin(), shown.end(), std::size_t{0});
  } else {
    shown = WorstFirst(scores);
    shown.resize(kMostLines);
  }
  return shown;
}

std::string SignalsNotInTable(std::span<const SignalScore> scores) {
  if (scores.size() <= kMostLines) return "";
  const std::vector<std::size_t> order = WorstFirst(scores);
  return fmt::format("{} more signals, nRMSE {:.3g} .. {:.3g} (--json: all)", scores.size() - kMostLines,
                     scores[order.back()].nrmse, scores[order[kMostLines]].nrmse);
}

std::size_t WidestSignal(std::span<const SignalScore> scores) {
  std::size_t width = 0;
  for (const SignalScore& score : scores) width = std::max(width, score.signal.size());
  return width;
}

}  // namespace gapscope
