#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "src/cli/commands.h"
#include "src/cli/print.h"
#include "src/cli/result_model.h"
#include "src/cli/session.h"
#include "src/core/file.h"
#include "src/report/apply_report.h"
#include "src/report/json.h"
#include "src/report/read_json.h"
#include "src/report/read_run.h"

namespace gapscope::cli {
namespace {

struct ApplyFlags {
  CommonFlags common;
  std::string result, experiment;
};

Result<int> RunApply(const ApplyFlags& flags) {
  GS_ASSIGN(const nlohmann::ordered_json json, ReadJson(flags.result));
  GS_ASSIGN(const ResultModel result, LoadWholeResult(json, {.path = flags.result, .experiment = flags.experiment}));
  const Experiment& experiment = result.model->experiment();
  const ApplyOptions options{.out = flags.common.out, .notes = NotesOf(json, *result.model, result.values)};
  GS_ASSIGN(const AppliedMjcf applied, ApplyToMjcf(*result.model, result.values, options));
  GS_RETURN_IF_ERROR(WriteFile(flags.common.out, applied.text));
  ApplyRun run{.model = experiment.model_path,
               .result = flags.result,
               .out = flags.common.out,
               .setter = experiment.settings.empty() ? "" : experiment.path,
               .changes = applied.changes,
               .time_step_s = NumberIn(json, "time_step_s"),
               .model_time_step_s = result.model->rig()->compiled().opt.timestep,
               .left_out = applied.left_out};
  run.needs_plugins = applied.text.find("plugin=\"gapscope.") != std::string::npos;
  for (const auto& use : result.model->effects()) {
    if (EffectOf(use, *result.model->rig()).place == EffectPlace::kSignal) run.of_signals.push_back(use);
  }
  Print(stdout, "{}", flags.common.json ? JsonText(ToJson(run)) : ToTable(run));
  return kDone;
}

}  // namespace

Command ApplyCommand() {
  auto flags = std::make_shared<ApplyFlags>();
  const std::vector<Option> own = {
      {.flag = "result",
       .value = &flags->result,
       .required = true,
       .help = "Folder that diagnose, tune or replay wrote with --out, or its result.json"},
      {.flag = "--out",
       .value = &flags->common.out,
       .required = true,
       .help = "The changed MJCF",
       .more =
           "Best beside the MJCF itself, or the MJCF itself. Files that it includes are named as seen from its folder"},
      {.flag = "--experiment",
       .value = &flags->experiment,
       .unset = "the one that the result names",
       .help = "Experiment file whose MJCF is changed",
       .more = "Another one where the files have moved since"}};
  return {.name = "apply",
          .what = "Write a result into your own MJCF: only the elements that change, each with a comment that says why",
          .options = Join({own, PrintOptions(flags->common)}),
          .example = "gapscope apply out/demo --out robot.xml",
          .run = [flags] { return RunApply(*flags); }};
}

}  // namespace gapscope::cli
