// Squared errors of a replay, summed by half seconds: what is independent of each other.
#ifndef GAPSCOPE_DIAGNOSE_BLOCK_SQUARES_H_
#define GAPSCOPE_DIAGNOSE_BLOCK_SQUARES_H_

#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "replay/replay.h"

namespace gapscope {

// By {log, half second}. `weight`: of the squares of a log's signal, both by their place.
using BlockSquares = std::map<std::pair<std::size_t, long>, double>;
BlockSquares SquaresByBlock(const std::vector<LogReplay>& logs,
                            const std::function<double(std::size_t log, std::size_t signal)>& weight);

// Weighed so that they add up to ReplayError's square, the same number of rows of each log taken as simulated.
BlockSquares NormalisedSquares(const std::vector<LogReplay>& logs);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_BLOCK_SQUARES_H_
