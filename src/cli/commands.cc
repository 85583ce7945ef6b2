#include "src/cli/commands.h"

namespace gapscope::cli {

std::vector<Command> AllCommands() {
  return {InitCommand(),    InspectCommand(), ReplayCommand(),   TuneCommand(),   DiagnoseCommand(),
          ExplainCommand(), ApplyCommand(),   IdentifyCommand(), DesignCommand(), RenderCommand(),
          PlanCommand(),    RunCommand(),     MergeCommand()};
}

}  // namespace gapscope::cli
