// What every run's result begins and ends with: seed and versions, and the model that it speaks of, by names. A run
// (ReplayRun, TuneRun, ...) is the typed value behind a command's result: JSON, console table and page are made of it.
#ifndef GAPSCOPE_REPORT_RUN_H_
#define GAPSCOPE_REPORT_RUN_H_

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "src/model/model.h"
#include "src/report/version.h"

namespace gapscope {

struct RunInfo {
  std::uint64_t seed = 0;
  std::string gapscope = GapscopeVersion(), mujoco = MujocoVersion();
};

// What it takes to build a run's model again. Values are of all its parameters, SI, in the model's order.
struct RunModel {
  std::vector<EffectUse> effects;
  std::vector<std::pair<std::string, double>> values;
};
RunModel RunModelOf(const Model& model, std::span<const double> values);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_RUN_H_
