#include "src/cli/commands.h"
#include "src/cli/fleet_file.h"

namespace gapscope::cli {
namespace {

struct FleetFlags {
  CommonFlags common;
  std::string file;
  int shards = 1;
};

Result<int> RunFleetPlan(const FleetFlags& flags) {
  GS_ASSIGN(Plan plan, LoadFleet(flags.file));
  plan.shards = flags.shards;
  GS_RETURN_IF_ERROR(WritePlan(std::move(plan), flags.common, true));
  return kDone;
}

Command FleetPlanCommand() {
  auto flags = std::make_shared<FleetFlags>();
  const std::vector<Option> own = {
      {.flag = "fleet",
       .value = &flags->file,
       .required = true,
       .help = "Fleet file (YAML)",
       .more = "It says which logs, of which robot and day, and what is done with them; "
               "docs/reference/fleet.md tells its keys"},
      {.flag = "--shards",
       .value = &flags->shards,
       .range = Between(1, 1000000),
       .help = "Parts that the work is meant to be done in",
       .more = "`gapscope fleet run --shard i/N` may use another N; no unit is done twice"}};
  return {.name = "plan",
          .what = "Share out a fleet's logs, a unit for each robot and day: writes --out/plan.json",
          .options = Join({own,
                           {FolderOption(flags->common, "plan.json and the results; all shards must reach it")},
                           CommonOptions(flags->common)}),
          .example = "gapscope fleet plan fleet.yaml --shards 8 --out work",
          .run = [flags] { return RunFleetPlan(*flags); }};
}

}  // namespace

Command FleetCommand() {
  Command run = RunCommand(), merge = MergeCommand();
  run.example = "gapscope fleet run --shard 1/8 work";
  merge.example = "gapscope fleet merge work";
  merge.what = "Put a fleet's results together: merged.json, tables, fleet.html; exit status 1 while any is missing";
  return {.name = "fleet",
          .what = "Many robots, day after day: which one drifts, since when, by which effect",
          .options = {},
          .example = "gapscope fleet plan fleet.yaml --out work",
          .run = {},
          .commands = {FleetPlanCommand(), std::move(run), std::move(merge)}};
}

}  // namespace gapscope::cli
