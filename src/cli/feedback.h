// `gapscope design lqr` and `gapscope design poles`: state feedback for a linearised rig.
#ifndef GAPSCOPE_CLI_FEEDBACK_H_
#define GAPSCOPE_CLI_FEEDBACK_H_

#include "src/cli/commands.h"

namespace gapscope::cli {

// Adds both to the `design` command.
void AddFeedback(CLI::App& design, Run& run);

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_FEEDBACK_H_
