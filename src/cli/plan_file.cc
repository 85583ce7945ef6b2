#include "src/cli/plan_file.h"

#include <fmt/core.h>

#include "src/report/read_run.h"
#include "src/report/version.h"
#include "src/tune/job_key.h"

namespace gapscope::cli {

using nlohmann::ordered_json;

std::string Hex(std::uint64_t number) { return fmt::format("{:016x}", number); }

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

Option PlanFolderOption(PlanFolderFlags& flags) {
  return {.flag = "folder", .value = &flags.folder, .required = true, .help = "The plan's folder"};
}

}  // namespace gapscope::cli
