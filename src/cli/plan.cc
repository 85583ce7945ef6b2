#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "src/cli/commands.h"
#include "src/cli/plan_file.h"
#include "src/core/collect.h"
#include "src/core/file.h"

namespace gapscope::cli {
namespace {

using nlohmann::ordered_json;

struct PlanFlags {
  CommonFlags common;
  ModelFlags model;
  int shards = 1, starts = 1;
};

Result<int> RunPlan(const PlanFlags& flags) {
  if (flags.common.out.empty())
    return Error{.what = "no folder for the plan", .where = "--out", .cure = "name one; all shards must reach it"};
  const auto absolute = [](const std::string& path) {
    return std::filesystem::absolute(path).lexically_normal().string();
  };
  ModelFlags model = flags.model;
  model.experiment = absolute(model.experiment);
  for (auto& path : model.params) path = absolute(path);
  std::vector<std::string> logs = Collect(model.logs, absolute);
  std::sort(logs.begin(), logs.end());
  logs.erase(std::unique(logs.begin(), logs.end()), logs.end());
  ordered_json plan = {{"schema", kPlanSchema},
                       {"experiment", model.experiment},
                       {"shards", flags.shards},
                       {"options",
                        {{"with", model.with},
                         {"set", model.set},
                         {"params", model.params},
                         {"while", model.while_column},
                         {"starts", flags.starts},
                         {"seed", flags.common.seed}}},
                       {"tasks", ordered_json::array()}};
  const std::string options = plan.at("options").dump();
  for (const auto& log : logs) {
    model.logs = {log};
    GS_ASSIGN(const Session session, LoadSession(model, flags.common));
    const std::uint64_t hash = TaskHash(session, session.recordings.front(), options);
    plan["tasks"].push_back({{"log", log}, {"task", Hex(hash)}});
  }
  const std::filesystem::path out = flags.common.out;
  std::error_code failure;
  std::filesystem::create_directories(out / "results", failure);
  if (failure)
    return Error{.what = "cannot make the folder", .where = (out / "results").string(), .actual = failure.message()};
  GS_RETURN_IF_ERROR(WriteFile(out / "plan.json", plan.dump(2) + "\n"));
  if (flags.common.json) {
    fmt::print("{}\n", plan.dump(2));
  } else {
    fmt::print("{} logs in {} shards: gapscope run --shard i/{} {} for i = 1..{}, then gapscope merge {}\n",
               logs.size(), flags.shards, flags.shards, out.string(), flags.shards, out.string());
  }
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
