// The subcommands. Each adds itself to the program and says what to run once the arguments are parsed; the callback
// returns the exit status.
#ifndef GAPSCOPE_CLI_COMMANDS_H_
#define GAPSCOPE_CLI_COMMANDS_H_

#include <CLI/CLI.hpp>
#include <functional>

#include "src/core/result.h"

namespace gapscope::cli {

using Run = std::function<Result<int>()>;

void AddInit(CLI::App& program, Run& run);
void AddIdentify(CLI::App& program, Run& run);
void AddInspect(CLI::App& program, Run& run);
void AddDesign(CLI::App& program, Run& run);
void AddDiagnose(CLI::App& program, Run& run);
void AddReplay(CLI::App& program, Run& run);
void AddRender(CLI::App& program, Run& run);
void AddTune(CLI::App& program, Run& run);
void AddPlan(CLI::App& program, Run& run);  // plan, run and merge: many logs, shared out

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_COMMANDS_H_
