#include "src/cli/commands.h"

#include <fmt/core.h>

#include <cstdio>
#include <memory>

#include "src/cli/print.h"
#include "src/model/plugin_library.h"

namespace gapscope::cli {
namespace {

// A command that builds models, or those below it: plugins of the user's are loaded before it runs.
Command WithPlugins(Command command) {
  for (Command& below : command.commands) below = WithPlugins(std::move(below));
  if (!command.run) return command;
  auto files = std::make_shared<std::vector<std::string>>();
  command.options.push_back({.flag = "--plugin",
                             .value = command.plugins ? command.plugins : files.get(),
                             .help = "Library of MuJoCo plugins, loaded first; more than once",
                             .more = "For plugins of your own in the MJCF, or as candidates of the experiment file "
                                     "(docs/how-to/candidates.md). It runs in this program: load only what you trust. "
                                     "One that does not load is left out, and stderr says so"});
  command.run = [files, plugins = command.plugins, run = command.run]() -> Result<int> {
    GS_ASSIGN(const std::vector<std::string> left_out, LoadPluginLibraries(plugins ? *plugins : *files));
    for (const std::string& text : left_out) Print(stderr, "warning: {}\n", text);
    return run();
  };
  return command;
}

}  // namespace

std::vector<Command> AllCommands() {
  return {WithPlugins(InitCommand()),
          InspectCommand(),
          ConvertCommand(),
          WithPlugins(ReplayCommand()),
          WithPlugins(TuneCommand()),
          WithPlugins(DiagnoseCommand()),
          WithPlugins(ExplainCommand()),
          WithPlugins(ApplyCommand()),
          WithPlugins(ExportCommand()),
          WithPlugins(IdentifyCommand()),
          WithPlugins(DesignCommand()),
          WithPlugins(RenderCommand()),
          WithPlugins(PlanCommand()),
          WithPlugins(RunCommand()),
          MergeCommand(),
          WithPlugins(FleetCommand()),
          WithPlugins(MonitorCommand()),
          DoctorCommand(),
          CiteCommand()};
}

}  // namespace gapscope::cli
