// A replay's traces scored: per log, per signal, per condition.
#ifndef GAPSCOPE_COMPARE_COMPARISON_H_
#define GAPSCOPE_COMPARE_COMPARISON_H_

#include <string>
#include <vector>

#include "replay/replay.h"
#include "src/compare/conditions.h"
#include "src/compare/score.h"
#include "src/model/rig.h"

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

// `rig`: tells which command drives which signal.
Comparison Compare(const Rig& rig, const ReplayResult& result, const std::vector<Recording>& recordings,
                   ThreadPool& pool);

// Signals by number, those with the greatest nrmse first, one without a number before all.
std::vector<std::size_t> WorstFirst(std::span<const SignalScore> scores);

// What is telling where a log has many signals is said of the worst ones alone.
inline constexpr std::size_t kSignalsTold = 6;
std::vector<ConditionShare> TellOfWorst(const LogComparison& log, const TellingOptions& options);

}  // namespace gapscope

#endif  // GAPSCOPE_COMPARE_COMPARISON_H_
