// A replay with the loop closed: the experiment's controller reads the simulated sensors and drives the simulated rig,
// so that logs of rigs that fall over without their controller can be replayed from end to end. Small differences grow
// and saturate in such a loop: traces part, and what can be compared is how the rig moves, in statistics.
#ifndef GAPSCOPE_REPLAY_CLOSED_LOOP_H_
#define GAPSCOPE_REPLAY_CLOSED_LOOP_H_

#include "replay/controller.h"
#include "replay/replay.h"

namespace gapscope {

// Of one signal over a run.
struct MotionStatistics {
  double mean = 0, deviation = 0, low = 0, high = 0;  // low, high: 2.5 and 97.5 percentiles
  double crossings_hz = 0;  // passages of the mean upwards a second, with a dead band of a quarter of the deviation
};
MotionStatistics StatisticsOf(const std::vector<double>& time_s, const std::vector<double>& values);

struct ClosedLoopResult {
  ReplayResult result;                    // mode kClosedLoop
  std::vector<std::vector<double>> sent;  // per log: the command in the loop
};

// Starts from the log's first row. The controller runs at the stamps, its command acts from there (later by a
// `command_delay` of the model) to the next stamp; sensors count as the experiment's `resolution` says; a torque
// reading and sensor delays are not simulated. The step is at most `options.time_step_s` (0: the model's own). Errors:
// those of Controller::Make.
Result<ClosedLoopResult> ReplayClosedLoop(const Model& model, const std::vector<Recording>& recordings,
                                          const ControllerSpec& spec, const ReplayOptions& options, ThreadPool& pool);

}  // namespace gapscope

#endif  // GAPSCOPE_REPLAY_CLOSED_LOOP_H_
