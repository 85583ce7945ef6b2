#include "src/draft/loops.h"

#include <algorithm>
#include <cmath>

#include "src/core/mujoco_handles.h"

namespace gapscope {

double LoopGap(const mjModel& model, const Samples& samples, const std::vector<Guess>& guesses, const Pairing& pairing,
               const Scalings& scalings) {
  const DataPtr data(mj_makeData(&model));
  for (std::size_t j = 0; j < pairing.joints.size(); ++j) {
    if (pairing.positions[j].column < 0) continue;
    const double raw = samples.values(guesses[pairing.positions[j].column].column).front();
    const Scaling& scaling = scalings.positions[j];
    if (std::isfinite(raw)) data->qpos[model.jnt_qposadr[pairing.joints[j].joint]] = scaling.factor * raw + scaling.add;
  }
  mj_fwdPosition(&model, data.get());
  double gap = 0;
  for (int i = 0; i < data->ne; ++i) {
    const int type = model.eq_type[data->efc_id[i]];
    if (type == mjEQ_CONNECT || type == mjEQ_WELD) gap = std::max(gap, std::abs(data->efc_pos[i]));
  }
  return gap;
}

}  // namespace gapscope
