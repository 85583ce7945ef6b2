// The subcommands, each as data: its options, and what to run once they are read. The command line, `--help` and
// docs/reference/options.md are made from these; only cli/arguments.cc knows the library that reads a command line.
#ifndef GAPSCOPE_CLI_COMMANDS_H_
#define GAPSCOPE_CLI_COMMANDS_H_

#include <functional>
#include <string>
#include <vector>

#include "src/core/options.h"
#include "src/core/result.h"

namespace gapscope::cli {

struct Command {
  std::string name, what;            // what: one line
  std::vector<Option> options;       // they write into what `run` holds
  std::string example;               // "gapscope replay ..."
  std::function<Result<int>()> run;  // gives the exit status; none where there are commands below this one
  std::vector<Command> commands;
  std::vector<std::string>* plugins = nullptr;  // where the words of --plugin go, of a command that has to know them
  // Of a command that goes on without plugins: told how its run crashed, it leaves them out. False: it has none.
  std::function<bool(const std::string&)> leave_out_plugins;
};

Command InitCommand();
Command InspectCommand();
Command ConvertCommand();
Command ReplayCommand();
Command TuneCommand();
Command DiagnoseCommand();
Command ExplainCommand();
Command IdentifyCommand();  // one command below it for each method
Command DesignCommand();    // these below it:
Command ChirpCommand();
std::vector<Command> InputCommands();     // sweep, steps, triangle, multisine, square
std::vector<Command> FeedbackCommands();  // lqr, poles
Command OptimalCommand();
Command RenderCommand();
Command ApplyCommand();
Command ExportCommand();
Command PlanCommand();  // plan, run and merge: many logs, shared out
Command RunCommand();
Command MergeCommand();
Command FleetCommand();  // the same, of robots and days
Command MonitorCommand();
Command DoctorCommand();
Command CiteCommand();

std::vector<Command> AllCommands();

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_COMMANDS_H_
