#include "src/draft/motion.h"

#include <algorithm>
#include <cmath>

#include "src/core/mujoco_handles.h"
#include "src/core/statistics.h"

namespace gapscope {

Motions MotionsOf(const std::vector<const Samples*>& logs, const std::vector<Guess>& guesses, const Pairing& p,
                  const Scalings& s, double half_width_s) {
  Motions motions(p.joints.size());
  for (std::size_t j = 0; j < p.joints.size(); ++j) {
    if (p.positions[j].column < 0) continue;
    const double factor = s.positions[j].factor, add = s.positions[j].add;
    for (const Samples* log : logs) {
      for (const auto& m : log->MotionOf(guesses[p.positions[j].column].column, half_width_s))
        motions[j].push_back({factor * m.value + add, factor * m.slope, factor * m.curvature});
    }
  }
  return motions;
}

std::vector<std::vector<double>> TorquesOf(const mjModel& model, const Pairing& p, const Motions& motions) {
  const ModelPtr free(mj_copyModel(nullptr, &model));
  free->opt.disableflags |= mjDSBL_CONSTRAINT | mjDSBL_ACTUATION;
  const DataPtr data(mj_makeData(free.get()));
  std::vector<std::vector<double>> torques(p.joints.size());
  std::size_t rows = 0;
  for (const auto& motion : motions) rows = std::max(rows, motion.size());
  for (std::size_t k = 0; k < rows; ++k) {
    mj_resetData(free.get(), data.get());
    bool known = true;
    for (std::size_t j = 0; j < p.joints.size(); ++j) {
      if (motions[j].empty()) continue;
      const auto& [q, v, a] = motions[j][k];
      const int joint = p.joints[j].joint;
      known = known && std::isfinite(q + v + a);
      data->qpos[model.jnt_qposadr[joint]] = q;
      data->qvel[model.jnt_dofadr[joint]] = v;
      data->qacc[model.jnt_dofadr[joint]] = a;
    }
    if (known) mj_inverse(free.get(), data.get());
    for (std::size_t j = 0; j < p.joints.size(); ++j)
      torques[j].push_back(known ? data->qfrc_inverse[model.jnt_dofadr[p.joints[j].joint]] : kNaN);
  }
  return torques;
}

}  // namespace gapscope
