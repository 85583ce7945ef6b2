// A model by names: what a result says of it, and what it takes to build it again.
#ifndef GAPSCOPE_MODEL_RUN_MODEL_H_
#define GAPSCOPE_MODEL_RUN_MODEL_H_

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "src/model/model.h"

namespace gapscope {

// Values are of all its parameters, SI, in the model's order.
struct RunModel {
  std::string experiment;  // the experiment file's path as it was given; empty: it is not said
  std::vector<EffectUse> effects;
  std::vector<std::pair<std::string, double>> values;
};
RunModel RunModelOf(const Model& model, std::span<const double> values);

struct ResultModel {
  std::shared_ptr<const Model> model;
  std::vector<double> values;
};

// A model by names, of this rig. `where` they come from, for errors: an effect or a parameter that the rig does not
// have.
Result<ResultModel> BuildRunModel(std::shared_ptr<const Rig> rig, const RunModel& named, const std::string& where,
                                  const ScaleTable& scales);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_RUN_MODEL_H_
