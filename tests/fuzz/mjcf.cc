// An MJCF, with our plugins in it or not: loaded, copied, compiled, and some steps.
#include <algorithm>

#include "src/model/model.h"
#include "tests/fuzz/fuzz.h"

FUZZ_TARGET(mjcf) {
  using namespace gapscope;
  Experiment experiment;
  experiment.path = "experiment.yaml";
  experiment.model_path = fuzz::FileOf(fuzz::Text(data, size));
  const auto loaded = Model::Load(experiment);
  if (!loaded.ok()) {
    fuzz::CheckRefusal(loaded.error(), experiment.model_path);
    return 0;
  }
  const mjModel& model = loaded.value()->compiled();
  constexpr int kMostOfAKind = 100;
  if (std::max({model.nv, model.nu, model.nsensordata}) > kMostOfAKind) return 0;
  try {
    const DataPtr state(mj_makeData(&model));
    for (int step = 0; step < 5; ++step) {
      std::fill_n(state->ctrl, model.nu, step % 2 ? 1.0 : -0.5);
      mj_step(&model, state.get());
    }
  } catch (const std::exception&) {
    return 0;  // MuJoCo's own refusal, through Rig's handler
  }
  fuzz::whole = true;
  return 0;
}
