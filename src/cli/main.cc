// gapscope: finds why a simulated mechanism does not move like the real one.
#include <fmt/core.h>

#include <algorithm>
#include <cstdio>
#include <exception>

#include "src/cli/commands.h"
#include "src/cli/html.h"
#include "src/cli/session.h"
#include "src/core/names.h"
#include "src/report/version.h"

int main(int argc, char** argv) {
  using namespace gapscope;
  CLI::App program{"gapscope finds why a simulated mechanism does not move like the real one.", "gapscope"};
  program.set_version_flag("--version", VersionText());
  program.require_subcommand(1);
  program.footer(
      "Exit status: 0 done, 1 a threshold asked for was not met, 2 bad input, 3 a bug.\nExample: gapscope replay "
      "models/qube/experiment.yaml log.csv");
  cli::SetCommandLine(argc, argv);
  cli::Run run;
  cli::AddInit(program, run);
  cli::AddInspect(program, run);
  cli::AddReplay(program, run);
  cli::AddTune(program, run);
  cli::AddDiagnose(program, run);
  cli::AddIdentify(program, run);
  cli::AddDesign(program, run);
  cli::AddRender(program, run);
  cli::AddPlan(program, run);
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    const bool asked = e.get_exit_code() == 0;  // --help, --version
    std::vector<std::string> names;
    for (const CLI::App* command : program.get_subcommands({})) names.push_back(command->get_name());
    if (!asked && argc > 1 && argv[1][0] != '-' && std::find(names.begin(), names.end(), argv[1]) == names.end()) {
      const std::string nearest = Nearest(argv[1], names);
      fmt::print(stderr, "gapscope: no command '{}'{}\n", argv[1],
                 nearest.empty() ? "" : "; did you mean '" + nearest + "'?");
    }
    program.exit(e);
    return asked ? cli::kDone : cli::kBadInput;
  }
  try {
    const auto status = run();
    if (status.ok()) return status.value();
    fmt::print(stderr, "gapscope: {}\n", status.error().Text());
    return cli::kBadInput;
  } catch (const std::exception& e) {
    fmt::print(stderr, "gapscope: internal error: {}\nPlease report this with the command and the files.\n", e.what());
    return cli::kBug;
  }
}
