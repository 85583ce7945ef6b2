// Thousands of logs, shared out: `plan` names the work, `run --shard i/N` does a part of it wherever it is started,
// `merge` puts the parts together. Every log is a task of its own whose name is a hash of all that decides its result
// (logged numbers, experiment, MJCF, options, version), and whose result is one file of that name, written at once. So
// shards need no order, no lock and no common state but the folder; a task that is there is not done again, and running
// a shard twice, or on another number of machines, changes nothing.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "src/cli/commands.h"
#include "src/cli/session.h"
#include "src/core/file.h"
#include "src/report/read_run.h"
#include "src/report/tune_report.h"
#include "src/report/version.h"
#include "src/tune/job_key.h"

namespace gapscope::cli {
namespace {

using nlohmann::ordered_json;
constexpr char kPlanSchema[] = "gapscope.plan/1";

struct PlanFlags {
  CommonFlags common;
  ModelFlags model;
  int shards = 1, starts = 1;
};

struct ShardFlags {
  CommonFlags common;
  std::string folder, shard;
};

std::string Hex(std::uint64_t number) { return fmt::format("{:016x}", number); }

// Everything that decides the task's result.
std::uint64_t TaskHash(const Session& session, const Recording& recording, const std::string& options) {
  Hasher hasher;
  hasher.Text(options).Text(VersionText()).Numbers(session.values);  // of --params files too
  AddModel(*session.model, &hasher);
  AddRecording(recording, &hasher);
  return hasher.value();
}

Result<ordered_json> ReadPlan(const std::filesystem::path& folder) {
  GS_ASSIGN(ordered_json plan, ReadJson((folder / "plan.json").string()));
  if (plan.value("schema", "") != kPlanSchema)
    return Error{.what = "not a plan",
                 .where = (folder / "plan.json").string(),
                 .allowed = kPlanSchema,
                 .cure = "write it with gapscope plan"};
  return plan;
}

ModelFlags ModelOf(const ordered_json& plan, const std::string& log) {
  const auto& options = plan.at("options");
  return {.experiment = plan.at("experiment"),
          .logs = {log},
          .with = options.at("with"),
          .set = options.at("set"),
          .params = options.at("params"),
          .while_column = options.at("while")};
}

Result<int> RunPlan(const PlanFlags& flags) {
  if (flags.common.out.empty())
    return Error{.what = "no folder for the plan", .where = "--out", .cure = "name one; all shards must reach it"};
  const auto absolute = [](const std::string& path) {
    return std::filesystem::absolute(path).lexically_normal().string();
  };
  ModelFlags model = flags.model;
  model.experiment = absolute(model.experiment);
  for (auto& path : model.params) path = absolute(path);
  std::vector<std::string> logs;
  for (const auto& log : model.logs) logs.push_back(absolute(log));
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

Result<int> RunShard(const ShardFlags& flags) {
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

// A plan's results together.
struct MergeRun {
  struct Log {
    std::string log, task;
    TuneRun fit;
  };
  struct Parameter {
    std::string name, unit;
    std::vector<double> values;  // of logs that know it, ascending
  };
  ordered_json plan;
  std::vector<Log> logs;
  std::vector<ordered_json> failed;  // as their tasks wrote them
  std::vector<std::string> missing;  // logs
  std::vector<Parameter> parameters;
  std::vector<double> held_out;  // errors, ascending
};

double Quantile(const std::vector<double>& sorted, double q) {
  return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1) + 0.5)];
}

// Fills in what the logs say together.
void Gather(MergeRun* run) {
  for (const auto& log : run->logs) {
    if (std::isfinite(log.fit.error_held_out)) run->held_out.push_back(log.fit.error_held_out);
    for (const auto& p : log.fit.parameters) {
      auto known = std::find_if(run->parameters.begin(), run->parameters.end(),
                                [&](const auto& other) { return other.name == p.name; });
      if (known == run->parameters.end()) known = run->parameters.insert(known, {p.name, p.unit, {}});
      if (p.identifiable) known->values.push_back(p.value);
    }
  }
  std::sort(run->held_out.begin(), run->held_out.end());
  for (auto& p : run->parameters) std::sort(p.values.begin(), p.values.end());
}

Result<MergeRun> ReadTasks(const std::filesystem::path& folder) {
  MergeRun run;
  GS_ASSIGN(run.plan, ReadPlan(folder));
  for (const auto& task : run.plan.at("tasks")) {
    const std::string path = folder / "results" / (task.at("task").get<std::string>() + ".json");
    const auto file = std::filesystem::exists(path) ? ReadJson(path) : Result<ordered_json>(Error{.what = "none"});
    if (!file.ok()) {
      run.missing.push_back(task.at("log"));
      continue;
    }
    const ordered_json& json = file.value();
    if (json.contains("error")) {
      run.failed.push_back(json);
      continue;
    }
    GS_ASSIGN(TuneRun fit, ReadTuneRun(json.value("result", ordered_json::object()), path));
    run.logs.push_back({task.at("log"), task.at("task"), std::move(fit)});
  }
  Gather(&run);
  return run;
}

ordered_json ToJson(const MergeRun& run) {
  ordered_json merged = {{"schema", "gapscope.merge/1"},
                         {"experiment", run.plan.at("experiment")},
                         {"options", run.plan.at("options")},
                         {"parameters", ordered_json::array()},
                         {"logs", ordered_json::array()},
                         {"failed", run.failed},
                         {"missing", run.missing}};
  for (const auto& [name, unit, values] : run.parameters) {
    ordered_json entry = {{"name", name}, {"unit", unit}, {"logs", values.size()}};
    if (!values.empty()) {
      entry["p10"] = Quantile(values, 0.1);
      entry["median"] = Quantile(values, 0.5);
      entry["p90"] = Quantile(values, 0.9);
    }
    merged["parameters"].push_back(std::move(entry));
  }
  for (const auto& [log, task, fit] : run.logs) {
    merged["logs"].push_back({{"log", log},
                              {"task", task},
                              {"termination", fit.termination},
                              {"error", JsonErrors(fit)},
                              {"parameters", JsonParameters(fit)}});
  }
  return merged;
}

std::string ToTable(const MergeRun& run) {
  std::string table =
      fmt::format("{:<44} {:>6} {:>12} {:>12} {:>12}  {}\n", "parameter", "logs", "10 %", "median", "90 %", "unit");
  for (const auto& [name, unit, values] : run.parameters) {
    table += values.empty() ? fmt::format("{:<44} {:>6} {:>12}\n", name, 0, "not known")
                            : fmt::format("{:<44} {:>6} {:>12.4g} {:>12.4g} {:>12.4g}  {}\n", name, values.size(),
                                          Quantile(values, 0.1), Quantile(values, 0.5), Quantile(values, 0.9), unit);
  }
  if (!run.held_out.empty())
    table += fmt::format("held-out error: median {:.4g}, 90 % {:.4g}\n", Quantile(run.held_out, 0.5),
                         Quantile(run.held_out, 0.9));
  return table +
         fmt::format("{} logs merged, {} failed, {} missing\n", run.logs.size(), run.failed.size(), run.missing.size());
}

Result<int> RunMerge(const ShardFlags& flags) {
  const std::filesystem::path folder = flags.folder;
  GS_ASSIGN(const MergeRun run, ReadTasks(folder));
  const std::string json = ToJson(run).dump(2) + "\n";
  GS_RETURN_IF_ERROR(WriteFile(folder / "merged.json", json));
  fmt::print("{}", flags.common.json ? json : ToTable(run));
  return run.failed.empty() && run.missing.empty() ? kDone : kBelowThreshold;
}

}  // namespace

void AddPlan(CLI::App& program, Run& run) {
  auto plan_flags = std::make_shared<PlanFlags>();
  CLI::App* plan =
      program.add_subcommand("plan", "Share out the tuning of many logs, each on its own: writes --out/plan.json");
  AddModelFlags(*plan, plan_flags->model, true);
  AddCommonFlags(*plan, plan_flags->common, true);
  plan->add_option("--shards", plan_flags->shards, "Parts that the work is meant to be done in")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  plan->add_option("--starts", plan_flags->starts, "Starting points of each fit")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  plan->footer("Example: gapscope plan models/qube/experiment.yaml logs/*.csv --shards 8 --out work");
  plan->callback([plan_flags, &run] { run = [plan_flags] { return RunPlan(*plan_flags); }; });

  auto shard_flags = std::make_shared<ShardFlags>();
  CLI::App* shard = program.add_subcommand("run", "Do one shard of a plan; what is done already is left alone");
  shard->add_option("folder", shard_flags->folder, "The plan's folder")->required();
  shard->add_option("--shard", shard_flags->shard, "i/N: every N-th log from the i-th on")->required();
  AddCommonFlags(*shard, shard_flags->common, false);
  shard->footer("Example: gapscope run --shard 1/8 work");
  shard->callback([shard_flags, &run] { run = [shard_flags] { return RunShard(*shard_flags); }; });

  auto merge_flags = std::make_shared<ShardFlags>();
  CLI::App* merge =
      program.add_subcommand("merge", "Put a plan's results together; exit status 1 while any is missing or failed");
  merge->add_option("folder", merge_flags->folder, "The plan's folder")->required();
  AddCommonFlags(*merge, merge_flags->common, false);
  merge->footer("Example: gapscope merge work --json");
  merge->callback([merge_flags, &run] { run = [merge_flags] { return RunMerge(*merge_flags); }; });
}

}  // namespace gapscope::cli
