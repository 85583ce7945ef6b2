// What a replay with the loop closed adds to a replay's report: how the rig moves and what is sent, measured against
// predicted, in statistics.
#ifndef GAPSCOPE_REPORT_CLOSED_LOOP_REPORT_H_
#define GAPSCOPE_REPORT_CLOSED_LOOP_REPORT_H_

#include <string>

#include "replay/closed_loop.h"

namespace gapscope {

std::string StatisticsTable(const ClosedLoopResult& closed, const std::vector<Recording>& recordings,
                            const ControllerSpec& spec);
// `replay_json` (gapscope.replay/1) with "statistics" in each log.
std::string WithStatistics(const std::string& replay_json, const ClosedLoopResult& closed,
                           const std::vector<Recording>& recordings, const ControllerSpec& spec);
// FOLDER/LOG.csv: __time, logged and closed-loop command.
Status WriteSent(const std::string& folder, const ClosedLoopResult& closed, const std::vector<Recording>& recordings,
                 const ControllerSpec& spec);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_CLOSED_LOOP_REPORT_H_
