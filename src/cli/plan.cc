#include <algorithm>
#include <filesystem>

#include "src/cli/commands.h"
#include "src/cli/plan_file.h"
#include "src/core/collect.h"

namespace gapscope::cli {
namespace {

struct PlanFlags {
  CommonFlags common;
  ModelFlags model;
  int shards = 1, starts = 1;
};

Result<int> RunPlan(const PlanFlags& flags) {
  const auto absolute = [](const std::string& path) {
    return std::filesystem::absolute(path).lexically_normal().string();
  };
  const ModelFlags& model = flags.model;
  std::vector<std::string> logs = Collect(model.logs, absolute);
  std::sort(logs.begin(), logs.end());
  logs.erase(std::unique(logs.begin(), logs.end()), logs.end());
  Plan plan{.experiment = absolute(model.experiment),
            .options = {{"with", model.with},
                        {"set", model.set},
                        {"params", Collect(model.params, absolute)},
                        {"while", model.while_column},
                        {"starts", flags.starts},
                        {"seed", flags.common.seed}},
            .shards = flags.shards,
            .columns = {},
            .time = {},
            .units = {}};
  for (const auto& log : logs) plan.units.push_back({.id = {}, .group = {}, .logs = {log}});
  GS_RETURN_IF_ERROR(WritePlan(std::move(plan), flags.common, false));
  return kDone;
}

}  // namespace

Command PlanCommand() {
  auto flags = std::make_shared<PlanFlags>();
  const std::vector<Option> own = {
      {.flag = "--shards",
       .value = &flags->shards,
       .range = Between(1, 1000000),
       .help = "Parts that the work is meant to be done in",
       .more = "`gapscope run --shard i/N` may use another N; no task is done twice"},
      {.flag = "--starts", .value = &flags->starts, .range = Between(1, 1000), .help = "Starting points of each fit"}};
  return {.name = "plan",
          .what = "Share out the tuning of many logs, each on its own: writes --out/plan.json",
          .options = Join({LogOptions(flags->model),
                           own,
                           EffectOptions(flags->model),
                           {FolderOption(flags->common, "plan.json and the results; all shards must reach it")},
                           CommonOptions(flags->common)}),
          .example = "gapscope plan models/qube/experiment.yaml logs/*.csv --shards 8 --out work",
          .run = [flags] { return RunPlan(*flags); }};
}

}  // namespace gapscope::cli
