// Thousands of logs, shared out: `plan` names the work, `run --shard i/N` does a part of it wherever it is started,
// `merge` puts the parts together. Every log is a task of its own whose name is a hash of all that decides its result
// (logged numbers, experiment, MJCF, options, version), and whose result is one file of that name, written at once. So
// shards need no order, no lock and no common state but the folder; a task that is there is not done again, and running
// a shard twice, or on another number of machines, changes nothing.
#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "src/cli/commands.h"
#include "src/cli/session.h"
#include "src/core/file.h"
#include "src/report/tune_report.h"
#include "src/report/version.h"
#include "src/tune/journal.h"

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
Result<std::uint64_t> TaskHash(const Session& session, const Recording& recording, const std::string& options) {
  GS_ASSIGN(const std::string experiment, ReadFile(session.experiment.path));
  GS_ASSIGN(const std::string mjcf, ReadFile(session.experiment.model_path));
  std::uint64_t hash = Hash(experiment.data(), experiment.size());
  hash = Hash(mjcf.data(), mjcf.size(), hash);
  const std::string text = options + VersionText();
  hash = Hash(text.data(), text.size(), hash);
  hash = Hash(session.values.data(), sizeof(double) * session.values.size(), hash);  // of --params files too
  const auto add = [&](const std::vector<double>& numbers) {
    hash = Hash(numbers.data(), sizeof(double) * numbers.size(), hash);
  };
  add(recording.time_s);
  for (const auto& command : recording.commands) add(command.values);
  for (const auto& measured : recording.measured) add(measured.values);
  for (const auto& [name, value] : recording.values)
    hash = Hash(&value, sizeof value, Hash(name.data(), name.size(), hash));
  return hash;
}

Status WriteAtOnce(const std::filesystem::path& path, const std::string& text) {
  const std::filesystem::path part = path.string() + fmt::format(".{}.part", getpid());
  GS_RETURN_IF_ERROR(WriteFile(part, text));
  std::error_code failure;
  std::filesystem::rename(part, path, failure);
  if (failure) return Error{.what = "cannot write", .where = path.string(), .actual = failure.message()};
  return Ok();
}

Result<ordered_json> ReadJson(const std::filesystem::path& path) {
  GS_ASSIGN(const std::string text, ReadFile(path.string()));
  ordered_json json = ordered_json::parse(text, nullptr, false);
  if (json.is_discarded())
    return Error{.what = "not JSON", .where = path.string(), .cure = "remove it and run its shard again"};
  return json;
}

Result<ordered_json> ReadPlan(const std::filesystem::path& folder) {
  GS_ASSIGN(ordered_json plan, ReadJson(folder / "plan.json"));
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
    GS_ASSIGN(const std::uint64_t hash, TaskHash(session, session.recordings.front(), options));
    plan["tasks"].push_back({{"log", log}, {"task", Hex(hash)}});
  }
  const std::filesystem::path out = flags.common.out;
  std::error_code failure;
  std::filesystem::create_directories(out / "results", failure);
  if (failure)
    return Error{.what = "cannot make the folder", .where = (out / "results").string(), .actual = failure.message()};
  GS_RETURN_IF_ERROR(WriteAtOnce(out / "plan.json", plan.dump(2) + "\n"));
  if (flags.common.json) {
    fmt::print("{}\n", plan.dump(2));
  } else {
    fmt::print("{} logs in {} shards: gapscope run --shard i/{} {} for i = 1..{}, then gapscope merge {}\n",
               logs.size(), flags.shards, flags.shards, out.string(), flags.shards, out.string());
  }
  return kDone;
}

// One log's fit as the text of its result file; nothing in it depends on when, where or how fast.
std::string DoTask(const ordered_json& plan, const std::string& log, const std::string& task,
                   const CommonFlags& common) {
  const auto failed = [&](const Error& error) {
    return ordered_json{{"log", log}, {"task", task}, {"error", error.Text()}}.dump(2);
  };
  auto loaded = LoadSession(ModelOf(plan, log), common);
  if (!loaded.ok()) return failed(loaded.error());
  Session& session = loaded.value();
  const auto hash = TaskHash(session, session.recordings.front(), plan.at("options").dump());
  if (!hash.ok()) return failed(hash.error());
  if (Hex(hash.value()) != task)
    return failed({.what = "the log, the experiment or the program has changed since the plan",
                   .where = log,
                   .cure = "write the plan again"});
  TuneOptions options{.window_s = session.experiment.replay.window_s, .starts = plan.at("options").at("starts")};
  options.solve.seed = plan.at("options").at("seed");
  if (session.experiment.replay.mode == ReplayMode::kWindows) options.objective = Objective::kWindows;
  auto tuned =
      Tune(*session.model, SplitData(std::move(session.recordings), {}), session.values, options, *session.pool);
  if (!tuned.ok()) return failed(tuned.error());
  ordered_json result = ordered_json::parse(TuneJson(tuned.value(), *session.model, options.solve.seed));
  result.erase("wall_s");
  result.erase("solve_s");
  return ordered_json{{"log", log}, {"task", task}, {"result", result}}.dump(2);
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
    const std::string text = DoTask(plan, log, task, flags.common);
    GS_RETURN_IF_ERROR(WriteAtOnce(path, text + "\n"));
    const bool failed = ordered_json::parse(text).contains("error");
    failures += failed;
    ++done;
    if (!flags.common.quiet) fmt::print(stderr, "{}: {}\n", log, failed ? "failed" : "done");
  }
  fmt::print(stderr, "shard {}: {} done ({} failed), {} were there\n", flags.shard, done, failures, there);
  return failures > 0 ? kBelowThreshold : kDone;
}

Result<int> RunMerge(const ShardFlags& flags) {
  GS_ASSIGN(const ordered_json plan, ReadPlan(flags.folder));
  ordered_json merged = {{"schema", "gapscope.merge/1"},    {"experiment", plan.at("experiment")},
                         {"options", plan.at("options")},   {"parameters", ordered_json::array()},
                         {"logs", ordered_json::array()},   {"failed", ordered_json::array()},
                         {"missing", ordered_json::array()}};
  std::vector<std::string> names;
  std::map<std::string, std::vector<double>> values;  // of logs that know the parameter
  std::map<std::string, std::string> units;
  std::vector<double> held_out;
  for (const auto& task : plan.at("tasks")) {
    const std::filesystem::path path =
        std::filesystem::path(flags.folder) / "results" / (task.at("task").get<std::string>() + ".json");
    const auto file = std::filesystem::exists(path) ? ReadJson(path) : Result<ordered_json>(Error{.what = "none"});
    if (!file.ok()) {
      merged["missing"].push_back(task.at("log"));
      continue;
    }
    const ordered_json& json = file.value();
    if (json.contains("error")) {
      merged["failed"].push_back(json);
      continue;
    }
    const auto& result = json.at("result");
    merged["logs"].push_back({{"log", json.at("log")},
                              {"task", json.at("task")},
                              {"termination", result.at("termination")},
                              {"error", result.at("error")},
                              {"parameters", result.at("parameters")}});
    if (result.at("error").at("held_out").is_number()) held_out.push_back(result.at("error").at("held_out"));
    for (const auto& p : result.at("parameters")) {
      const std::string name = p.at("name");
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
      units[name] = p.at("unit");
      if (p.at("identifiable").get<bool>()) values[name].push_back(p.at("value"));
    }
  }
  const auto quantile = [](std::vector<double>& sorted, double q) {
    return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1) + 0.5)];
  };
  std::string table =
      fmt::format("{:<44} {:>6} {:>12} {:>12} {:>12}  {}\n", "parameter", "logs", "10 %", "median", "90 %", "unit");
  for (const auto& name : names) {
    auto& known = values[name];
    std::sort(known.begin(), known.end());
    ordered_json entry = {{"name", name}, {"unit", units[name]}, {"logs", known.size()}};
    if (!known.empty()) {
      entry["p10"] = quantile(known, 0.1), entry["median"] = quantile(known, 0.5), entry["p90"] = quantile(known, 0.9);
      table += fmt::format("{:<44} {:>6} {:>12.4g} {:>12.4g} {:>12.4g}  {}\n", name, known.size(), quantile(known, 0.1),
                           quantile(known, 0.5), quantile(known, 0.9), units[name]);
    } else {
      table += fmt::format("{:<44} {:>6} {:>12}\n", name, 0, "not known");
    }
    merged["parameters"].push_back(entry);
  }
  std::sort(held_out.begin(), held_out.end());
  if (!held_out.empty())
    table +=
        fmt::format("held-out error: median {:.4g}, 90 % {:.4g}\n", quantile(held_out, 0.5), quantile(held_out, 0.9));
  table += fmt::format("{} logs merged, {} failed, {} missing\n", merged["logs"].size(), merged["failed"].size(),
                       merged["missing"].size());
  const bool whole = merged["failed"].empty() && merged["missing"].empty();
  GS_RETURN_IF_ERROR(WriteAtOnce(std::filesystem::path(flags.folder) / "merged.json", merged.dump(2) + "\n"));
  fmt::print("{}", flags.common.json ? merged.dump(2) + "\n" : table);
  return whole ? kDone : kBelowThreshold;
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
  shard->footer("Example: gapscope run --shard 0/8 work");
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
