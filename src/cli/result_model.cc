#include "src/cli/result_model.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "src/core/collect.h"
#include "src/report/read_run.h"

namespace gapscope::cli {

Result<ResultModel> BuildRunModel(std::shared_ptr<const Rig> rig, const RunModel& named, const std::string& where,
                                  const ScaleTable& scales) {
  ResultModel result;
  GS_ASSIGN(const auto uses, ParseEffects(Collect(named.effects, &EffectUse::Text), *rig));
  GS_ASSIGN(result.model, Model::Build(std::move(rig), uses, scales));
  result.values = result.model->Nominal();
  for (const auto& [name, value] : named.values) {
    if (!std::isfinite(value)) return Error{.what = "the value of '" + name + "' is no number", .where = where};
    GS_ASSIGN(const int index, result.model->Find(name, where));
    result.values[index] = value;
  }
  return result;
}

Result<ResultModel> LoadResultModel(std::shared_ptr<const Rig> rig, const std::string& path, const ScaleTable& scales) {
  GS_ASSIGN(const auto json, ReadJson(path));
  GS_ASSIGN(const RunModel named, ReadRunModel(json, path));
  return BuildRunModel(std::move(rig), named, path, scales);
}

}  // namespace gapscope::cli
