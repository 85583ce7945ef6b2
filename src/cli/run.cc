#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "src/cli/commands.h"
#include "src/cli/diagnose_job.h"
#include "src/cli/plan_file.h"
#include "src/cli/print.h"
#include "src/core/file.h"
#include "src/report/json.h"
#include "src/report/read_run.h"
#include "src/report/tune_report.h"
#include "src/report/unit_result.h"

namespace gapscope::cli {
namespace {

using nlohmann::ordered_json;

// The fit of a unit's logs. Nothing in it depends on when, where or how fast it was made.
Result<ordered_json> TuneUnit(const Plan& plan, Session session) {
  const TuneOptions options =
      DefaultTuneOptions(session.experiment.replay, plan.options.at("starts"), plan.options.at("seed"));
  GS_ASSIGN(const TuneSummary tuned,
            Tune(*session.model, SplitData(std::move(session.recordings), {}), session.values, options, *session.pool));
  return ToJson(TuneRunOf(tuned, *session.model, options.solve.seed), Timing::kLeaveOut);
}

// Empty: it was interrupted.
Result<ordered_json> DiagnoseUnit(const Plan& plan, const PlanUnit& unit, const PlanFolderFlags& flags) {
  const std::string name = plan.options.at("effort");
  const auto effort = ValueOf<SearchEffort>(name);
  if (!effort) return NoSuch("no such effort", name, NamesOf<SearchEffort>(), flags.folder + "/plan.json");
  DiagnoseFlags diagnose{
      .common = flags.common, .model = ModelOf(plan, unit), .effort = *effort, .no_next_experiment = true};
  diagnose.common.seed = plan.options.at("seed");
  diagnose.common.out = plan.reports ? ReportFolder(flags.folder, unit).string() : "";
  GS_ASSIGN(const DiagnoseRun run, DiagnoseLogs(diagnose));
  return run.diagnosis.interrupted ? ordered_json() : ToJson(run, Timing::kLeaveOut);
}

Result<ordered_json> DoUnit(const Plan& plan, const PlanUnit& unit, const PlanFolderFlags& flags) {
  GS_ASSIGN(Session session, LoadSession(ModelOf(plan, unit), flags.common));
  if (UnitId(plan, session) != unit.id)
    return Error{.what = "the log, the experiment or the program has changed since the plan",
                 .where = unit.logs.front(),
                 .cure = "write the plan again"};
  if (plan.what == "tune") return TuneUnit(plan, std::move(session));
  return DiagnoseUnit(plan, unit, flags);
}

// A bug that one unit meets does not stop the others.
Result<ordered_json> TryUnit(const Plan& plan, const PlanUnit& unit, const PlanFolderFlags& flags) {
  try {
    return DoUnit(plan, unit, flags);
  } catch (const std::exception& e) {
    return Error{.what = "internal error", .where = unit.logs.front(), .actual = e.what()};
  }
}

// A failure is tried again: what was missing may be there now.
bool IsDone(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path)) return false;
  const auto before = ReadJson(path);
  return before.ok() && before.value().contains("result") &&
         ReadUnitResult(before.value()["result"], path.string()).ok();
}

// The units that are asked for.
Result<std::vector<const PlanUnit*>> Chosen(const Plan& plan, const PlanFolderFlags& flags) {
  if (flags.unit.empty() == flags.shard.empty())
    return Error{.what = "which units?", .where = "the command line", .allowed = "--shard i/N, or --unit ID"};
  std::vector<const PlanUnit*> chosen;
  if (!flags.unit.empty()) {
    for (const auto& unit : plan.units) {
      if (unit.id == flags.unit) return std::vector<const PlanUnit*>{&unit};
    }
    return Error{.what = "no such unit",
                 .where = "--unit",
                 .actual = "'" + flags.unit + "'",
                 .allowed = fmt::format("a 'task' of the {} in {}/plan.json", plan.units.size(), flags.folder)};
  }
  int shard = 0, shards = 0;
  std::sscanf(flags.shard.c_str(), "%d/%d", &shard, &shards);
  for (std::size_t i = static_cast<std::size_t>(shard) - 1; i < plan.units.size();
       i += static_cast<std::size_t>(shards))
    chosen.push_back(&plan.units[i]);
  return chosen;
}

Status CheckShard(const std::string& text) {
  int shard = 0, shards = 0, end = 0;
  if (std::sscanf(text.c_str(), "%d/%d%n", &shard, &shards, &end) == 2 && end == static_cast<int>(text.size()) &&
      shard >= 1 && shard <= shards)
    return Ok();
  return Error{
      .what = "not a shard", .where = "--shard", .actual = "'" + text + "'", .allowed = "i/N with 1 <= i <= N"};
}

struct Ran {
  int asked = 0, done = 0, failed = 0, there = 0;  // there: done before
  bool interrupted = false;
};

void Say(const Ran& ran, const PlanFolderFlags& flags) {
  if (flags.common.json) {
    Print(stdout, "{}",
          JsonText({{"schema", "gapscope.run/1"},
                    {"units", ran.asked},
                    {"done", ran.done},
                    {"failed", ran.failed},
                    {"there", ran.there},
                    {"interrupted", ran.interrupted}}));
  } else if (!flags.common.quiet) {
    Print(stderr, "{} {}: {} done ({} failed), {} were there{}\n", flags.unit.empty() ? "shard" : "unit",
          flags.unit.empty() ? flags.shard : flags.unit, ran.done + ran.failed, ran.failed, ran.there,
          ran.interrupted ? "; interrupted: run it again, what is done stays" : "");
  }
}

Result<int> RunUnits(const PlanFolderFlags& flags) {
  if (!flags.shard.empty()) GS_RETURN_IF_ERROR(CheckShard(flags.shard));
  GS_ASSIGN(const Plan plan, ReadPlan(flags.folder));
  GS_ASSIGN(const auto chosen, Chosen(plan, flags));
  Ran ran{.asked = static_cast<int>(chosen.size())};
  for (const PlanUnit* unit : chosen) {
    const std::filesystem::path path = ResultPath(flags.folder, *unit);
    if (IsDone(path)) {
      ++ran.there;
      continue;
    }
    const auto result = TryUnit(plan, *unit, flags);
    ran.interrupted = result.ok() && result.value().is_null();
    if (ran.interrupted) break;
    ordered_json file = JsonUnit(plan, *unit);
    if (result.ok()) {
      file["result"] = result.value();
    } else {
      file["error"] = result.error().Text();
    }
    GS_RETURN_IF_ERROR(WriteFile(path, JsonText(file)));
    ++(result.ok() ? ran.done : ran.failed);
    if (!flags.common.quiet) Print(stderr, "{}: {}\n", unit->logs.front(), result.ok() ? "done" : "failed");
  }
  Say(ran, flags);
  return ran.failed > 0 || ran.interrupted ? kBelowThreshold : kDone;
}

}  // namespace

Command RunCommand() {
  auto flags = std::make_shared<PlanFolderFlags>();
  const std::vector<Option> which = {
      {.flag = "--shard",
       .value = &flags->shard,
       .unset = "--unit says which",
       .help = "i/N with 1 <= i <= N: every N-th unit from the i-th on",
       .more = "A unit is a log of `gapscope plan`, or a group of logs of `gapscope fleet plan`"},
      {.flag = "--unit",
       .value = &flags->unit,
       .unset = "--shard says which",
       .help = "One unit: a 'task' of plan.json"}};
  return {.name = "run",
          .what = "Do one shard of a plan, or one unit; what is done already is left alone",
          .options = Join({{PlanFolderOption(*flags)}, which, CommonOptions(flags->common)}),
          .example = "gapscope run --shard 1/8 work",
          .run = [flags] { return RunUnits(*flags); }};
}

}  // namespace gapscope::cli
