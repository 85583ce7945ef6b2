#include "src/cli/plan_file.h"

#include <fmt/core.h>

#include "src/cli/print.h"
#include "src/core/file.h"
#include "src/log/text.h"
#include "src/report/json.h"
#include "src/report/read_json.h"
#include "src/report/read_run.h"
#include "src/report/version.h"
#include "src/tune/job_key.h"

namespace gapscope::cli {
namespace {

using nlohmann::ordered_json;

std::string Hex(std::uint64_t number) { return fmt::format("{:016x}", number); }

// The options that ModelOf and `run` read; throws where one is missing or another kind of value.
void ReadOptions(const ordered_json& options, const std::string& what) {
  for (const char* list : {"with", "set", "params"}) options.at(list).get<std::vector<std::string>>();
  options.at("while").get<std::string>();
  WholeFrom<std::uint64_t>(options.at("seed"));
  if (what == "tune") WholeFrom<int>(options.at("starts"));
  if (what == "diagnose") options.at("effort").get<std::string>();
}

Plan PlanFrom(const ordered_json& json) {
  Plan plan{.experiment = json.at("experiment"),
            .what = json.at("what"),
            .options = json.at("options"),
            .reports = json.at("reports"),
            .shards = WholeFrom<int>(json.at("shards")),
            .columns = json.at("columns"),
            .time = json.at("time"),
            .units = {}};
  ReadOptions(plan.options, plan.what);
  for (const auto& task : json.at("tasks")) {
    PlanUnit unit{.id = task.at("task"), .group = {}, .logs = {}};
    if (task.contains("log")) {
      unit.logs = {task.at("log")};
    } else {
      unit.logs = task.at("logs").get<std::vector<std::string>>();
      for (const auto& column : plan.columns) unit.group.push_back(task.at("group").at(column));
    }
    plan.units.push_back(std::move(unit));
  }
  return plan;
}

constexpr char kWriteIt[] = "write it with gapscope plan or gapscope fleet plan";

// An id names files in the plan's folder.
bool IsId(const std::string& id) {
  return id.size() == Hex(0).size() && id.find_first_not_of("0123456789abcdef") == std::string::npos;
}

// What the commands take for granted.
Status CheckPlan(const Plan& plan, const std::string& where) {
  const auto broken = [&](const char* what, const std::string& actual, const std::string& allowed) {
    return Error{.what = what, .where = where, .actual = Quoted(actual), .allowed = allowed, .cure = kWriteIt};
  };
  if (plan.what != "tune" && plan.what != "diagnose") return broken("no such work", plan.what, "tune, diagnose");
  if (plan.shards < 1) return broken("no number of shards", std::to_string(plan.shards), "1 or more");
  if (plan.units.empty()) return broken("a plan without units", "", "a task or more");
  for (const PlanUnit& unit : plan.units) {
    if (!IsId(unit.id)) return broken("not the name of a task", unit.id, "16 hexadecimal digits");
    if (unit.logs.empty()) return broken("a task without a log", unit.id, "one log or more");
  }
  return Ok();
}

// Of a unit that cannot be read: it fails when it is run, unless the files have been mended, and with them its name.
std::string FailedId(const Plan& plan, const PlanUnit& unit) {
  Hasher hasher;
  hasher.Text(plan.what).Text(plan.options.dump()).Text(VersionText()).Text(plan.experiment);
  for (const auto& log : unit.logs) hasher.Text(log);
  return Hex(hasher.value());
}

}  // namespace

ordered_json JsonUnit(const Plan& plan, const PlanUnit& unit) {
  if (plan.columns.empty() && unit.logs.size() == 1) return {{"log", unit.logs.front()}, {"task", unit.id}};
  ordered_json group = ordered_json::object();
  for (std::size_t i = 0; i < plan.columns.size(); ++i) group[plan.columns[i]] = unit.group[i];
  return {{"group", std::move(group)}, {"logs", unit.logs}, {"task", unit.id}};
}

ordered_json ToJson(const Plan& plan) {
  ordered_json json = {{"schema", kPlanSchema},
                       {"experiment", plan.experiment},
                       {"what", plan.what},
                       {"shards", plan.shards},
                       {"options", plan.options},
                       {"reports", plan.reports},
                       {"columns", plan.columns},
                       {"time", plan.time},
                       {"tasks", ordered_json::array()}};
  for (const auto& unit : plan.units) json["tasks"].push_back(JsonUnit(plan, unit));
  return json;
}

Result<Plan> PlanOf(const ordered_json& json, const std::string& where) {
  if (TextIn(json, "schema") != kPlanSchema)
    return Error{.what = "not a plan", .where = where, .allowed = kPlanSchema, .cure = kWriteIt};
  GS_ASSIGN(Plan plan, ReadGuarded([&] { return PlanFrom(json); }, where, kPlanSchema));
  GS_RETURN_IF_ERROR(CheckPlan(plan, where));
  return plan;
}

Result<Plan> ReadPlan(const std::filesystem::path& folder) {
  const std::string path = (folder / "plan.json").string();
  GS_ASSIGN(const ordered_json json, ReadJson(path));
  return PlanOf(json, path);
}

std::filesystem::path ResultPath(const std::filesystem::path& folder, const PlanUnit& unit) {
  return folder / "results" / (unit.id + ".json");
}
std::filesystem::path ReportFolder(const std::filesystem::path& folder, const PlanUnit& unit) {
  return folder / "reports" / unit.id;
}

ModelFlags ModelOf(const Plan& plan, const PlanUnit& unit) {
  return {.experiment = plan.experiment,
          .logs = unit.logs,
          .with = plan.options.at("with"),
          .set = plan.options.at("set"),
          .params = plan.options.at("params"),
          .while_column = plan.options.at("while")};
}

std::string UnitId(const Plan& plan, const Session& session) {
  Hasher hasher;
  hasher.Text(plan.what).Text(plan.options.dump()).Text(VersionText());
  hasher.Numbers(session.values);  // of --params files too
  AddModel(*session.model, &hasher);
  // By path too: a result names its logs.
  for (const auto& recording : session.recordings) {
    hasher.Text(recording.log_path);
    AddRecording(recording, &hasher);
  }
  return Hex(hasher.value());
}

Status WritePlan(Plan plan, const CommonFlags& flags, bool keep_going) {
  if (flags.out.empty())
    return Error{.what = "no folder for the plan", .where = "--out", .cure = "name one; all shards must reach it"};
  std::size_t unreadable = 0;
  for (auto& unit : plan.units) {
    const auto session = LoadSession(ModelOf(plan, unit), flags);
    if (!session.ok() && !keep_going) return session.error();
    unit.id = session.ok() ? UnitId(plan, session.value()) : FailedId(plan, unit);
    if (session.ok()) continue;
    ++unreadable;
    if (!flags.quiet) Print(stderr, "warning: {}\n", session.error().Text());
  }
  if (unreadable == plan.units.size())
    return Error{.what = "no unit of the plan can be read", .where = flags.out, .cure = "the warnings say why"};
  const std::filesystem::path out = flags.out;
  std::error_code failure;
  std::filesystem::create_directories(out / "results", failure);
  if (failure)
    return Error{.what = "cannot make the folder", .where = (out / "results").string(), .actual = failure.message()};
  const std::string json = JsonText(ToJson(plan));
  GS_RETURN_IF_ERROR(WriteFile(out / "plan.json", json));
  if (flags.json) {
    Print(stdout, "{}", json);
    return Ok();
  }
  const std::string fleet = plan.columns.empty() ? "" : "fleet ";
  Print(stdout, "{} {} in {} shards: gapscope {}run --shard i/{} {} for i = 1..{}, then gapscope {}merge {}\n",
        plan.units.size(), fleet.empty() ? "logs" : "units", plan.shards, fleet, plan.shards, out.string(), plan.shards,
        fleet, out.string());
  return Ok();
}

Option PlanFolderOption(PlanFolderFlags& flags) {
  return {.flag = "folder", .value = &flags.folder, .required = true, .help = "The plan's folder"};
}

}  // namespace gapscope::cli
