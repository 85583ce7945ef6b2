// Thousands of logs, shared out: `plan` names the work, `run` does a part of it wherever it is started, `merge` puts
// the parts together. A unit is a group of logs that give one result. Its name is a hash of all that decides that
// result (logged numbers, experiment, MJCF, options, version), and the result is one file of that name, written at
// once. So parts need no order, no lock and no common state but the folder; a unit that is there is not done again, and
// running one twice, or on another number of machines, changes nothing.
//
// Here: the files that the three commands share. `gapscope plan` makes a unit of each log; `gapscope fleet plan` also
// groups logs by columns of their paths.
#ifndef GAPSCOPE_CLI_PLAN_FILE_H_
#define GAPSCOPE_CLI_PLAN_FILE_H_

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "src/cli/session.h"

namespace gapscope::cli {

inline constexpr char kPlanSchema[] = "gapscope.plan/1";

struct PlanUnit {
  std::string id;                        // 16 hexadecimal digits
  std::vector<std::string> group, logs;  // group: the texts of Plan::columns
};

struct Plan {
  std::string experiment;
  std::string what = "tune";       // or "diagnose"
  nlohmann::ordered_json options;  // with, set, params, while, seed and starts or effort: what decides a result
  bool reports = false;            // a page of each unit's diagnosis
  int shards = 1;                  // that the work is meant to be done in
  std::vector<std::string> columns;
  std::string time;             // one of them, in whose order a robot's units stand; empty: none
  std::vector<PlanUnit> units;  // those of one robot stand together, in time
};

nlohmann::ordered_json ToJson(const Plan& plan);
// What names a unit in the files: its log, or its group and logs; its id.
nlohmann::ordered_json JsonUnit(const Plan& plan, const PlanUnit& unit);

// `json`: what the file `where` holds. Error: not a plan, or one that this program would not have written: a task that
// is not 16 hexadecimal digits (results are named by it), a unit without logs, an option that is not there.
Result<Plan> PlanOf(const nlohmann::ordered_json& json, const std::string& where);
// Error: no such file; as PlanOf.
Result<Plan> ReadPlan(const std::filesystem::path& folder);
std::filesystem::path ResultPath(const std::filesystem::path& folder, const PlanUnit& unit);
std::filesystem::path ReportFolder(const std::filesystem::path& folder, const PlanUnit& unit);

// The logs, and options as the plan has them.
ModelFlags ModelOf(const Plan& plan, const PlanUnit& unit);
// A unit's name by everything that decides its result.
std::string UnitId(const Plan& plan, const Session& session);

// Names the units, of which group and logs are known, and writes --out/plan.json. `keep_going`: a unit that cannot be
// read is planned all the same, and fails when it is run; else it is an error.
Status WritePlan(Plan plan, const CommonFlags& flags, bool keep_going);

// Of the commands on a plan.
struct PlanFolderFlags {
  CommonFlags common;
  std::string folder, shard, unit;
};
Option PlanFolderOption(PlanFolderFlags& flags);

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_PLAN_FILE_H_
