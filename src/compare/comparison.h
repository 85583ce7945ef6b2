// A replay's traces scored: per log, per signal, per condition.
#ifndef GAPSCOPE_COMPARE_COMPARISON_H_
#define GAPSCOPE_COMPARE_COMPARISON_H_

#include <string>
#include <vector>

#include "replay/replay.h"
#include "src/compare/conditions.h"
#include "src/compare/score.h"

namespace gapscope {

struct LogComparison {
  std::string log_path;
  double error = 0;                   // see CombinedError; infinity where the replay diverged
  std::vector<SignalScore> signals;   // all measured signals, scored or not
  std::vector<ConditionShare> where;  // shares of error and time of the scored signals
};

struct Comparison {
  double error = 0;  // root mean square over logs
  std::vector<LogComparison> logs;
};

Comparison Compare(const ReplayResult& result, const std::vector<Recording>& recordings, ThreadPool& pool);

}  // namespace gapscope

#endif  // GAPSCOPE_COMPARE_COMPARISON_H_
