// Of many windows those that say most.
#ifndef GAPSCOPE_FIT_CHOOSE_WINDOWS_H_
#define GAPSCOPE_FIT_CHOOSE_WINDOWS_H_

#include <cstddef>
#include <vector>

#include "replay/replay.h"

namespace gapscope {

struct LogWindow {
  std::size_t log = 0;
  Window rows;
};

// The `most` of `windows` that cover the states of the mechanism best, in the order given: D-optimal for a torque that
// is any function of a signal and its rate, of a command and its rate, and of time (constant on a grid of each). A
// state that is visited rarely counts as much as one that fills the logs; a mechanism at rest says little twice.
// Greedy, which for this submodular measure reaches 1 - 1/e of the best (Nemhauser, Wolsey, Fisher 1978).
std::vector<LogWindow> ChooseWindows(const std::vector<Recording>& recordings, const std::vector<LogWindow>& windows,
                                     std::size_t most);

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_CHOOSE_WINDOWS_H_
