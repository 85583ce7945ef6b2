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

Command InitCommand() {
  auto flags = std::make_shared<InitFlags>();
  return {.name = "init",
          .what = "Draft an experiment file for a robot of your own",
          .options = {{.flag = "model", .value = &flags->model, .required = true, .help = "MJCF file"},
                      {.flag = "logs",
                       .value = &flags->logs,
                       .required = true,
                       .help = "Hardware logs; the first one is looked at",
                       .more = "With --out the draft is then tried on all of them"},
                      {.flag = "--out",
                       .value = &flags->out,
                       .unset = "stdout",
                       .help = "File to write",
                       .more = "Paths in it are as seen from its folder"},
                      {.flag = "--quiet",
                       .value = &flags->quiet,
                       .help = "Do not list what is unsure",
                       .more = "Otherwise each guess that needs a look is told on stderr"}},
          .example = "gapscope init robot.xml run1.csv --out robot.yaml",
          .run = [flags] { return RunInit(*flags); }};
}

}  // namespace gapscope::cli
