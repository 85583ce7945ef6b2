// What a replay with the loop closed adds to a replay's result: how the rig moves and what is sent, measured against
// predicted, in statistics.
#ifndef GAPSCOPE_REPORT_CLOSED_LOOP_REPORT_H_
#define GAPSCOPE_REPORT_CLOSED_LOOP_REPORT_H_

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "replay/closed_loop.h"
#include "src/report/csv.h"

namespace gapscope {

struct SignalStatistics {
  std::string signal;
  MotionStatistics measured, predicted;
};

struct LoopStatistics {
  std::string actuator;  // whose command the controller sends
  struct Log {
    std::vector<SignalStatistics> signals;
    std::optional<MotionStatistics> logged;  // of the command; none: the log does not have it
    MotionStatistics sent;                   // of the command in the loop
  };
  std::vector<Log> logs;
};
LoopStatistics LoopStatisticsOf(const ClosedLoopResult& closed, const std::vector<Recording>& recordings,
                                const ControllerSpec& spec);

// {SIGNAL: {"measured", "predicted"}, "command ACTUATOR": ...} of one log.
nlohmann::ordered_json ToJson(const LoopStatistics::Log& log, const std::string& actuator);
// `log_paths`: by log.
std::string ToTable(const LoopStatistics& loop, const std::vector<std::string>& log_paths);

// closed_loop/LOG.csv of each log: __time, logged and closed-loop command. `sent` as in ClosedLoopResult. The tables
// point into the arguments.
std::vector<RunTable> SentTables(const std::vector<LogReplay>& logs, const std::vector<std::vector<double>>& sent,
                                 const std::vector<Recording>& recordings, const ControllerSpec& spec);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_CLOSED_LOOP_REPORT_H_
