#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include "src/cli/commands.h"
#include "src/cli/fleet_file.h"
#include "src/cli/plan_file.h"
#include "src/cli/print.h"
#include "src/core/file.h"
#include "src/report/fleet_report.h"
#include "src/report/json.h"
#include "src/report/read_json.h"
#include "src/report/read_run.h"

namespace gapscope::cli {
namespace {

using nlohmann::ordered_json;

double OfRank(const std::vector<double>& sorted, double q) {
  return sorted[static_cast<std::size_t>(std::lround(q * static_cast<double>(sorted.size() - 1)))];
}

// A cell of a CSV.
std::string Cell(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}
std::string Cell(double value) { return std::isfinite(value) ? fmt::format("{:.10g}", value) : ""; }

// A table beside merged.json, a row at a time.
class Table {
 public:
  static Result<Table> Open(const std::filesystem::path& path, const Plan& plan, const std::string& columns) {
    GS_ASSIGN(PartWriter file, PartWriter::Open(path.string()));
    std::string head = "task";
    for (const auto& column : plan.columns) head += "," + column;
    file.Write(head + columns + "\n");
    return Table(std::move(file));
  }
  template <class... Cells>
  void Row(const PlanUnit& unit, const Cells&... cells) {
    std::string row = unit.id;
    for (const auto& text : unit.group) row += "," + Cell(text);
    ((row += "," + Cell(cells)), ...);
    file_.Write(row + "\n");
  }
  Status Finish() { return file_.Finish(); }

 private:
  explicit Table(PartWriter file) : file_(std::move(file)) {}
  PartWriter file_;
};

// What all units say together: numbers and names, not the results themselves.
struct Totals {
  struct Parameter {
    std::string name, unit;
    std::vector<double> values;  // of units that know it
  };
  struct Said {
    std::string name;
    std::size_t present = 0, of = 0;
  };
  std::vector<Parameter> parameters;
  std::vector<Said> statements;
  std::vector<double> left;          // errors held out
  std::vector<ordered_json> failed;  // units with their errors
  std::vector<std::string> missing;  // logs
  std::vector<ordered_json> changes;
  std::size_t merged = 0, robots = 0;

  void Add(const UnitResult& unit) {
    ++merged;
    if (std::isfinite(unit.left)) left.push_back(unit.left);
    const auto of = [](auto& list, const std::string& name) -> auto& {
      const auto known = std::find_if(list.begin(), list.end(), [&](const auto& one) { return one.name == name; });
      if (known != list.end()) return *known;
      list.emplace_back().name = name;
      return list.back();
    };
    for (const auto& size : unit.sizes) {
      auto& parameter = of(parameters, size.name);
      parameter.unit = size.unit;
      if (std::isfinite(size.value)) parameter.values.push_back(size.value);
    }
    for (const auto& said : unit.statements) {
      auto& count = of(statements, said.name);
      count.present += said.answer == "present";
      ++count.of;
    }
  }
  void Sort() {
    std::sort(left.begin(), left.end());
    for (auto& p : parameters) std::sort(p.values.begin(), p.values.end());
    std::erase_if(statements, [](const Said& said) { return said.present == 0; });
    std::stable_sort(statements.begin(), statements.end(),
                     [](const Said& a, const Said& b) { return a.present > b.present; });
  }
};

// Reads the units one after the other, those of one robot together, and keeps only what the robot's series need.
class Merger {
 public:
  static Result<Merger> Open(const std::filesystem::path& folder, Plan plan) {
    GS_ASSIGN(PartWriter json, PartWriter::Open((folder / "merged.json").string()));
    GS_ASSIGN(Table units,
              Table::Open(folder / "units.csv", plan, ",log,state,error,verdict,probability,nominal,left,gap,report"));
    GS_ASSIGN(Table statements, Table::Open(folder / "statements.csv", plan, ",statement,answer,probability"));
    GS_ASSIGN(Table parameters, Table::Open(folder / "parameters.csv", plan, ",parameter,unit,value,low,high"));
    return Merger(folder, std::move(plan),
                  {std::move(json), std::move(units), std::move(statements), std::move(parameters)});
  }

  Status Run() {
    ordered_json head = {{"schema", "gapscope.merge/1"},
                         {"experiment", plan_.experiment},
                         {"what", plan_.what},
                         {"options", plan_.options}};
    std::string text = head.dump(2);
    files_.json.Write(text.substr(0, text.size() - 2) + ",\n  \"logs\": [");
    for (const auto& unit : plan_.units) {
      if (!robot_.empty() && RobotOf(*last_) != RobotOf(unit)) EndRobot();
      AddUnit(unit);
    }
    if (!robot_.empty()) EndRobot();
    totals_.Sort();
    return Finish();
  }

  const Totals& totals() const { return totals_; }
  const Plan& plan() const { return plan_; }

 private:
  struct Files {
    PartWriter json;
    Table units, statements, parameters;
  };
  Merger(std::filesystem::path folder, Plan plan, Files files)
      : folder_(std::move(folder)),
        plan_(std::move(plan)),
        files_(std::move(files)),
        page_(plan_.what, plan_.experiment, plan_.time) {}

  // All columns but the time, which is the last one.
  static std::vector<std::string> RobotOf(const PlanUnit& unit) {
    return {unit.group.begin(), unit.group.empty() ? unit.group.end() : std::prev(unit.group.end())};
  }

  // What is known of a unit; what goes into merged.json is written at once.
  UnitResult Read(const PlanUnit& unit) {
    const std::string path = ResultPath(folder_, unit).string();
    if (!std::filesystem::exists(path)) {
      totals_.missing.push_back(unit.logs.front());
      return {.state = "missing", .error = "it has not been run"};
    }
    const auto file = ReadJson(path);
    if (!file.ok()) return Failed(unit, file.error().Text());
    const ordered_json& json = file.value();
    if (const auto error = json.find("error"); error != json.end() && error->is_string()) return Failed(unit, *error);
    const auto at = json.find("result");
    const ordered_json none;
    const ordered_json& result = at == json.end() ? none : *at;
    auto known = ReadUnitResult(result, path);
    const auto parts = MergedParts(result, path);
    if (!known.ok() || !parts.ok()) return Failed(unit, (known.ok() ? parts.error() : known.error()).Text());
    ordered_json entry = JsonUnit(plan_, unit);
    entry.update(parts.value());
    files_.json.Write((totals_.merged > 0 ? ",\n    " : "\n    ") + entry.dump());
    totals_.Add(known.value());
    return std::move(known).value();
  }

  UnitResult Failed(const PlanUnit& unit, const std::string& error) {
    ordered_json entry = JsonUnit(plan_, unit);
    entry["error"] = error;
    totals_.failed.push_back(std::move(entry));
    return {.state = "failed", .error = error};
  }

  void AddUnit(const PlanUnit& unit) {
    UnitResult known = Read(unit);
    known.id = unit.id;
    known.time = unit.group.empty() ? "" : unit.group.back();
    const auto page = ReportFolder(folder_, unit) / "report.html";
    if (known.state == "done" && std::filesystem::exists(page)) known.report = "reports/" + unit.id + "/report.html";
    files_.units.Row(unit, unit.logs.front(), known.state, known.error, known.verdict, known.probability, known.nominal,
                     known.left, known.gap, known.report);
    for (const auto& said : known.statements) files_.statements.Row(unit, said.name, said.answer, said.probability);
    for (const auto& p : known.sizes) files_.parameters.Row(unit, p.name, p.unit, p.value, p.low, p.high);
    if (plan_.columns.empty()) return;
    times_.insert(known.time);
    robot_.push_back(std::move(known));
    last_ = &unit;
  }

  void EndRobot() {
    std::string name;
    for (const auto& text : RobotOf(*last_)) name += (name.empty() ? "" : " ") + text;
    if (name.empty()) name = "all";
    const auto changes = ChangesOf(robot_);
    for (const auto& change : changes) {
      totals_.changes.push_back({{"robot", name},
                                 {"what", change.series},
                                 {"since", robot_[change.first].time},
                                 {"before", JsonNumber(change.before)},
                                 {"after", JsonNumber(change.after)},
                                 {"chance", JsonNumber(change.chance)}});
    }
    page_.AddRobot(name, robot_, changes);
    ++totals_.robots;
    robot_.clear();
  }

  Status Finish() {
    ordered_json tail = {
        {"parameters", ordered_json::array()}, {"failed", totals_.failed}, {"missing", totals_.missing}};
    for (const auto& [name, unit, values] : totals_.parameters) {
      ordered_json entry = {{"name", name}, {"unit", unit}, {"logs", values.size()}};
      if (!values.empty()) {
        entry["p10"] = OfRank(values, 0.1);
        entry["median"] = OfRank(values, 0.5);
        entry["p90"] = OfRank(values, 0.9);
      }
      tail["parameters"].push_back(std::move(entry));
    }
    if (!plan_.columns.empty()) {
      tail["columns"] = plan_.columns;
      tail["time"] = plan_.time;
      tail["changes"] = totals_.changes;
    }
    files_.json.Write(fmt::format("{}],\n{}\n", totals_.merged > 0 ? "\n  " : "", tail.dump(2).substr(2)));
    GS_RETURN_IF_ERROR(files_.json.Finish());
    GS_RETURN_IF_ERROR(files_.units.Finish());
    GS_RETURN_IF_ERROR(files_.statements.Finish());
    GS_RETURN_IF_ERROR(files_.parameters.Finish());
    if (plan_.columns.empty()) return Ok();
    return WriteFile((folder_ / "fleet.html").string(), page_.Html({times_.begin(), times_.end()}));
  }

  struct Before {
    bool operator()(const std::string& a, const std::string& b) const { return TextBefore(a, b); }
  };
  std::filesystem::path folder_;
  Plan plan_;
  Files files_;
  FleetPage page_;
  Totals totals_;
  std::vector<UnitResult> robot_;  // the one whose units are read
  const PlanUnit* last_ = nullptr;
  std::set<std::string, Before> times_;
};

std::string ToTable(const Plan& plan, const Totals& totals) {
  std::string table =
      fmt::format("{:<44} {:>6} {:>12} {:>12} {:>12}  {}\n", "parameter", "logs", "10 %", "median", "90 %", "unit");
  for (const auto& [name, unit, values] : totals.parameters) {
    table += values.empty() ? fmt::format("{:<44} {:>6} {:>12}\n", name, 0, "not known")
                            : fmt::format("{:<44} {:>6} {:>12.4g} {:>12.4g} {:>12.4g}  {}\n", name, values.size(),
                                          OfRank(values, 0.1), OfRank(values, 0.5), OfRank(values, 0.9), unit);
  }
  for (const auto& said : totals.statements)
    table += fmt::format("{} is present in {} of {}\n", said.name, said.present, said.of);
  if (!totals.left.empty())
    table +=
        fmt::format("held-out error: median {:.4g}, 90 % {:.4g}\n", OfRank(totals.left, 0.5), OfRank(totals.left, 0.9));
  for (const auto& change : totals.changes)
    table += fmt::format("changed: {}, {} from {:.4g} to {:.4g} since {}\n", change["robot"].get<std::string>(),
                         change["what"].get<std::string>(), NumberFrom(change["before"]), NumberFrom(change["after"]),
                         change["since"].get<std::string>());
  if (!plan.columns.empty()) table += fmt::format("{} robots, {} changes\n", totals.robots, totals.changes.size());
  return table + fmt::format("{} {} merged, {} failed, {} missing\n", totals.merged,
                             plan.columns.empty() ? "logs" : "units", totals.failed.size(), totals.missing.size());
}

Result<int> RunMerge(const PlanFolderFlags& flags) {
  const std::filesystem::path folder = flags.folder;
  GS_ASSIGN(Plan plan, ReadPlan(folder));
  GS_ASSIGN(Merger merger, Merger::Open(folder, std::move(plan)));
  GS_RETURN_IF_ERROR(merger.Run());
  const Totals& totals = merger.totals();
  if (flags.common.json) {
    GS_ASSIGN(const std::string json, ReadFile((folder / "merged.json").string()));
    Print(stdout, "{}", json);
  } else {
    Print(stdout, "{}", ToTable(merger.plan(), totals));
  }
  return totals.failed.empty() && totals.missing.empty() ? kDone : kBelowThreshold;
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
