#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "src/cli/commands.h"
#include "src/cli/plan_file.h"
#include "src/core/file.h"
#include "src/report/read_run.h"
#include "src/report/tune_report.h"

namespace gapscope::cli {
namespace {

using nlohmann::ordered_json;

ModelFlags ModelOf(const ordered_json& plan, const std::string& log) {
  const auto& options = plan.at("options");
  return {.experiment = plan.at("experiment"),
          .logs = {log},
          .with = options.at("with"),
          .set = options.at("set"),
          .params = options.at("params"),
          .while_column = options.at("while")};
}

// One log's fit.
Result<TuneRun> DoTask(const ordered_json& plan, const std::string& log, const std::string& task,
                       const CommonFlags& common) {
  GS_ASSIGN(Session session, LoadSession(ModelOf(plan, log), common));
  if (Hex(TaskHash(session, session.recordings.front(), plan.at("options").dump())) != task)
    return Error{.what = "the log, the experiment or the program has changed since the plan",
                 .where = log,
                 .cure = "write the plan again"};
  TuneOptions options{.window_s = session.experiment.replay.window_s, .starts = plan.at("options").at("starts")};
  options.solve.seed = plan.at("options").at("seed");
  if (session.experiment.replay.mode == ReplayMode::kWindows) options.objective = ObjectiveKind::kWindows;
  GS_ASSIGN(const TuneSummary tuned,
            Tune(*session.model, SplitData(std::move(session.recordings), {}), session.values, options, *session.pool));
  return TuneRunOf(tuned, *session.model, options.solve.seed);
}

Result<int> RunShard(const PlanFolderFlags& flags) {
  int shard = 0, shards = 0, end = 0;
  if (std::sscanf(flags.shard.c_str(), "%d/%d%n", &shard, &shards, &end) != 2 ||
      end != static_cast<int>(flags.shard.size()) || shard < 1 || shard > shards) {
    return Error{.what = "not a shard",
                 .where = "--shard",
                 .actual = "'" + flags.shard + "'",
                 .allowed = "i/N with 1 <= i <= N"};
  }
  GS_ASSIGN(const ordered_json plan, ReadPlan(flags.folder));
  const std::filesystem::path results = std::filesystem::path(flags.folder) / "results";
  int done = 0, there = 0, failures = 0;
  const auto& tasks = plan.at("tasks");
  for (std::size_t i = static_cast<std::size_t>(shard) - 1; i < tasks.size(); i += static_cast<std::size_t>(shards)) {
    const std::string task = tasks[i].at("task"), log = tasks[i].at("log");
    const std::filesystem::path path = results / (task + ".json");
    // A failure is tried again: what was missing may be there now.
    const auto before = std::filesystem::exists(path) ? ReadJson(path) : Result<ordered_json>(Error{.what = "none"});
    if (before.ok() && before.value().contains("result")) {
      ++there;
      continue;
    }
    const auto fit = DoTask(plan, log, task, flags.common);
    // Nothing in it depends on when, where or how fast it was made.
    ordered_json file = {{"log", log}, {"task", task}};
    if (fit.ok()) {
      file["result"] = ToJson(fit.value(), Timing::kLeaveOut);
    } else {
      file["error"] = fit.error().Text();
    }
    GS_RETURN_IF_ERROR(WriteFile(path, file.dump(2) + "\n"));
    failures += !fit.ok();
    ++done;
    if (!flags.common.quiet) fmt::print(stderr, "{}: {}\n", log, fit.ok() ? "done" : "failed");
  }
  fmt::print(stderr, "shard {}: {} done ({} failed), {} were there\n", flags.shard, done, failures, there);
  return failures > 0 ? kBelowThreshold : kDone;
}

}  // namespace

Command RunCommand() {
  auto flags = std::make_shared<PlanFolderFlags>();
  const Option shard = {.flag = "--shard",
                        .value = &flags->shard,
                        .required = true,
                        .help = "i/N with 1 <= i <= N: every N-th log from the i-th on"};
  return {.name = "run",
          .what = "Do one shard of a plan; what is done already is left alone",
          .options = Join({{PlanFolderOption(*flags), shard}, CommonOptions(flags->common)}),
          .example = "gapscope run --shard 1/8 work",
          .run = [flags] { return RunShard(*flags); }};
}

}  // namespace gapscope::cli
