// Thousands of logs, shared out: `plan` names the work, `run --shard i/N` does a part of it wherever it is started,
// `merge` puts the parts together. Every log is a task of its own whose name is a hash of all that decides its result
// (logged numbers, experiment, MJCF, options, version), and whose result is one file of that name, written at once. So
// shards need no order, no lock and no common state but the folder; a task that is there is not done again, and running
// a shard twice, or on another number of machines, changes nothing.
//
// Here: the files that the three commands share.
#ifndef GAPSCOPE_CLI_PLAN_FILE_H_
#define GAPSCOPE_CLI_PLAN_FILE_H_

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "src/cli/session.h"

namespace gapscope::cli {

inline constexpr char kPlanSchema[] = "gapscope.plan/1";

// 16 hexadecimal digits: a task's name.
std::string Hex(std::uint64_t number);

// Everything that decides the task's result; `options` as the plan has them.
std::uint64_t TaskHash(const Session& session, const Recording& recording, const std::string& options);

// Error: no such file, or not a plan.
Result<nlohmann::ordered_json> ReadPlan(const std::filesystem::path& folder);

// Of the commands on a plan.
struct PlanFolderFlags {
  CommonFlags common;
  std::string folder, shard;
};
Option PlanFolderOption(PlanFolderFlags& flags);

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_PLAN_FILE_H_
