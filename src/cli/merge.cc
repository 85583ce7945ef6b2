#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "src/cli/commands.h"
#include "src/cli/plan_file.h"
#include "src/core/file.h"
#include "src/report/read_run.h"
#include "src/report/tune_report.h"

namespace gapscope::cli {
namespace {

using nlohmann::ordered_json;

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
  return sorted[static_cast<std::size_t>(std::lround(q * static_cast<double>(sorted.size() - 1)))];
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

Result<int> RunMerge(const PlanFolderFlags& flags) {
  const std::filesystem::path folder = flags.folder;
  GS_ASSIGN(const MergeRun run, ReadTasks(folder));
  const std::string json = ToJson(run).dump(2) + "\n";
  GS_RETURN_IF_ERROR(WriteFile(folder / "merged.json", json));
  fmt::print("{}", flags.common.json ? json : ToTable(run));
  return run.failed.empty() && run.missing.empty() ? kDone : kBelowThreshold;
}

}  // namespace

Command MergeCommand() {
  auto flags = std::make_shared<PlanFolderFlags>();
  return {.name = "merge",
          .what = "Put a plan's results together; exit status 1 while any is missing or failed",
          .options = Join({{PlanFolderOption(*flags)}, CommonOptions(flags->common)}),
          .example = "gapscope merge work --json",
          .run = [flags] { return RunMerge(*flags); }};
}

}  // namespace gapscope::cli
