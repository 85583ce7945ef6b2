// Residuals judged in blocks of half a second of a log: longer than sensors' noise remembers, short enough that a log
// has many.
#ifndef GAPSCOPE_FIT_BLOCKS_H_
#define GAPSCOPE_FIT_BLOCKS_H_

#include <vector>

#include "src/fit/fit_problem.h"

namespace gapscope {

// Scored rows of a window that lie in one half second of its log.
struct RowBlock {
  long half_second = 0;
  Eigen::Index begin = 0, count = 0;  // in the window's scored rows
};
std::vector<RowBlock> RowBlocks(const Recording& recording, const FitWindow& window);

// What the windows of a problem cost in one half second of a log.
struct BlockCost {
  std::size_t log = 0;
  long half_second = 0;
  std::size_t residuals = 0;  // numbers that are scored
  double cost = 0;            // without priors
};
// In the order of logs and time; windows without residuals (masked, or not simulated) are left out.
std::vector<BlockCost> CostsByBlock(const FitProblem& problem, const Residuals& residuals);

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_BLOCKS_H_
