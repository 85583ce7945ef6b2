#include <fmt/core.h>

#include <cstdio>
#include <filesystem>

#include "src/cli/commands.h"
#include "src/cli/session.h"
#include "src/core/file.h"
#include "src/model/draft.h"

namespace gapscope::cli {
namespace {

struct InitFlags {
  std::string model, out;
  std::vector<std::string> logs;
  bool quiet = false;
};

Result<int> RunInit(const InitFlags& flags) {
  GS_ASSIGN(const Log log, ReadLog(flags.logs.front(), {}));
  GS_ASSIGN(const Timeline timeline, BuildTimeline(log, {}));
  // The experiment names the model as seen from its own folder.
  const std::filesystem::path folder =
      flags.out.empty() ? std::filesystem::current_path() : std::filesystem::absolute(flags.out).parent_path();
  std::error_code failed;
  const std::filesystem::path relative =
      std::filesystem::relative(std::filesystem::absolute(flags.model), folder, failed);
  GS_ASSIGN(const Draft draft, DraftExperiment(flags.model, failed ? flags.model : relative.string(), log, timeline));
  if (flags.out.empty()) {
    fmt::print("{}", draft.yaml);
  } else {
    GS_RETURN_IF_ERROR(WriteFile(flags.out, draft.yaml));
  }
  // The draft must hold for every log that was given.
  if (!flags.out.empty()) {
    GS_ASSIGN(const Experiment experiment, LoadExperiment(flags.out));
    for (const auto& path : flags.logs)
      GS_RETURN_IF_ERROR([&]() -> Status {
        GS_ASSIGN(const Recording recording, LoadRecording(experiment, path));
        return Ok();
      }());
  }
  if (!flags.quiet) {
    for (const auto& doubt : draft.unsure) fmt::print(stderr, "unsure: {}\n", doubt);
    if (!flags.out.empty())
      fmt::print(stderr, "wrote {}; {} thing{} to check. Next: gapscope replay {} {}\n", flags.out, draft.unsure.size(),
                 draft.unsure.size() == 1 ? "" : "s", flags.out, flags.logs.front());
  }
  return kDone;
}

}  // namespace

void AddInit(CLI::App& program, Run& run) {
  auto flags = std::make_shared<InitFlags>();
  CLI::App* command = program.add_subcommand("init", "Draft an experiment file for a robot of your own");
  command->add_option("model", flags->model, "MJCF file")->required();
  command->add_option("logs", flags->logs, "Hardware logs; the first one is looked at")->required();
  command->add_option("--out", flags->out, "File to write (default: stdout)");
  command->add_flag("--quiet", flags->quiet, "Do not list what is unsure");
  command->footer("Example: gapscope init robot.xml run1.csv --out robot.yaml");
  command->callback([flags, &run] { run = [flags] { return RunInit(*flags); }; });
}

}  // namespace gapscope::cli
