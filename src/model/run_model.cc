#include "src/model/run_model.h"

namespace gapscope {

RunModel RunModelOf(const Model& model, std::span<const double> values) {
  RunModel run{.experiment = model.experiment().path, .effects = model.effects(), .values = {}};
  for (std::size_t i = 0; i < values.size(); ++i) run.values.emplace_back(model.parameters()[i].name, values[i]);
  return run;
}

}  // namespace gapscope
