// plan.json of a plan's folder, which `run` and `merge` go by.
#include "src/cli/plan_file.h"
#include "src/report/read_run.h"
#include "tests/fuzz/fuzz.h"

FUZZ_TARGET(plan) {
  using namespace gapscope;
  const std::string& path = fuzz::FileOf(fuzz::Text(data, size));
  const auto json = ReadJson(path);
  if (!json.ok()) return 0;
  const auto plan = cli::PlanOf(json.value(), path);
  if (!plan.ok()) {
    fuzz::CheckRefusal(plan.error(), path);
    return 0;
  }
  const std::filesystem::path folder = "folder";
  for (const auto& unit : plan.value().units) {
    if (cli::ResultPath(folder, unit).lexically_normal().parent_path() != folder / "results")
      fuzz::Complain("a result outside the plan's folder");
    cli::ModelOf(plan.value(), unit);
    if (unit.logs.empty()) fuzz::Complain("a unit without logs");
  }
  cli::ToJson(plan.value()).dump();
  fuzz::whole = true;
  return 0;
}
