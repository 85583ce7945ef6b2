#include "src/model/run_model.h"

#include <cmath>

#include "src/core/collect.h"

namespace gapscope {

RunModel RunModelOf(const Model& model, std::span<const double> values) {
  RunModel run{.experiment = model.experiment().path, .effects = model.effects(), .values = {}};
  for (std::size_t i = 0; i < values.size(); ++i) run.values.emplace_back(model.parameters()[i].name, values[i]);
  return run;
}

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

}  // namespace gapscope
