// Squared errors of a replay, summed by half seconds: what is independent of each other.
#ifndef GAPSCOPE_DIAGNOSE_BLOCK_ERRORS_H_
#define GAPSCOPE_DIAGNOSE_BLOCK_ERRORS_H_

#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "replay/replay.h"

namespace gapscope {

// Of one signal of a log, where it was simulated. SI.
struct SignalErrors {
  bool scored = false;
  double deviation = 0;  // of what was measured, over the whole log
  double rows = 0;
  std::map<long, double> squares;  // by half second

  double Rms() const;  // NaN: nothing was simulated
};
using BlockErrors = std::vector<std::vector<SignalErrors>>;  // by log and signal
BlockErrors ErrorsByBlock(const std::vector<LogReplay>& logs);

// By {log, half second}. `weight`: of the squares of a log's signal, both by their place.
using BlockSquares = std::map<std::pair<std::size_t, long>, double>;
BlockSquares SquaresByBlock(const BlockErrors& errors,
                            const std::function<double(std::size_t log, std::size_t signal)>& weight);

// Weighed so that they add up to ReplayError's square, the same number of rows of each log taken as simulated.
BlockSquares NormalisedSquares(const BlockErrors& errors);

// Of each log: ReplayError of it alone.
std::vector<double> NormalisedErrors(const BlockErrors& errors);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_BLOCK_ERRORS_H_
