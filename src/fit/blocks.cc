#include "src/fit/blocks.h"

#include <map>
#include <utility>

#include "src/core/collect.h"
#include "src/fit/policy.h"

namespace gapscope {

std::vector<RowBlock> RowBlocks(const Recording& recording, const FitWindow& window) {
  const Eigen::Index scored = window.scored();
  const double* time = recording.time_s.data() + window.rows.begin + window.first_scored;
  std::vector<RowBlock> blocks;
  for (Eigen::Index begin = 0; begin < scored;) {
    const auto number = static_cast<long>(time[begin] / kFitPolicy.block_s);
    Eigen::Index end = begin + 1;
    while (end < scored && static_cast<long>(time[end] / kFitPolicy.block_s) == number) ++end;
    blocks.push_back({.half_second = number, .begin = begin, .count = end - begin});
    begin = end;
  }
  return blocks;
}

std::vector<BlockCost> CostsByBlock(const FitProblem& problem, const Residuals& residuals) {
  std::map<std::pair<std::size_t, long>, BlockCost> blocks;
  for (std::size_t w = 0; w < problem.windows().size(); ++w) {
    if (residuals[w].size() == 0) continue;
    const FitWindow& window = problem.windows()[w];
    const auto& signals = problem.layout().signals[window.log];
    for (const RowBlock& rows : RowBlocks(problem.recordings()[window.log], window)) {
      BlockCost& block = blocks[{window.log, rows.half_second}];
      block.log = window.log, block.half_second = rows.half_second;
      for (std::size_t s = 0; s < signals.size(); ++s) {
        if (!(signals[s].weight > 0)) continue;
        const Eigen::VectorXd part =
            residuals[w].segment(static_cast<Eigen::Index>(s) * window.scored() + rows.begin, rows.count);
        block.cost += 0.5 * problem.huber().Sum(part);
        block.residuals += static_cast<std::size_t>(rows.count);
      }
    }
  }
  return Collect(blocks, [](const auto& entry) { return entry.second; });
}

}  // namespace gapscope
