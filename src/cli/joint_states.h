// What a result says of its logs, as joint states of the real mechanism and of the simulated one: for viewers.
#ifndef GAPSCOPE_CLI_JOINT_STATES_H_
#define GAPSCOPE_CLI_JOINT_STATES_H_

#include <string>
#include <vector>

#include "src/core/thread_pool.h"
#include "src/log/log.h"

namespace gapscope::cli {

// A table for each log of a result of replay, tune or diagnose (`path`: its folder): __time, and for each measured
// signal of a joint /real/joint_states/JOINT/KIND beside /sim/joint_states/JOINT/KIND, where KIND is position, velocity
// or effort; Log::path is the name of its trace, without an extension. Signals of no joint are a finding. A diagnosis
// has no traces: the logs that judged it are replayed. Errors: not such a result; its experiment or a log is not there;
// no signal is a joint's.
Result<std::vector<Log>> JointStatesOf(const std::string& path, ThreadPool& pool);

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_JOINT_STATES_H_
