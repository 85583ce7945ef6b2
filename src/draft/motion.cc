#include "src/draft/motion.h"

#include <algorithm>
#include <cmath>

#include "src/core/mujoco_handles.h"
#include "src/core/statistics.h"

namespace gapscope {

namespace {

// At an end stop the stop bears the torque.
constexpr double kNearStop = 0.02;  // of the joint's range: stops give way, and angles have noise

bool AtStop(const mjModel& model, int joint, const Samples::Motion& motion) {
  if (!model.jnt_limited[joint]) return false;
  const double low = model.jnt_range[2 * joint], high = model.jnt_range[2 * joint + 1];
  const double near = kNearStop * (high - low);
  return motion.lowest < low + near || motion.highest > high - near;
}

}  // namespace

Motions MotionsOf(const std::vector<const Samples*>& logs, const std::vector<Guess>& guesses, const Pairing& p,
                  const Scalings& s, double half_width_s) {
  Motions motions(p.joints.size());
  for (std::size_t j = 0; j < p.joints.size(); ++j) {
    if (p.positions[j].column < 0) continue;
    const double factor = s.positions[j].factor, add = s.positions[j].add;
    for (const Samples* log : logs) {
      for (const auto& m : log->MotionOf(guesses[p.positions[j].column].column, half_width_s)) {
        const auto [lowest, highest] = std::minmax({factor * m.lowest + add, factor * m.highest + add});
        motions[j].push_back({factor * m.value + add, factor * m.slope, factor * m.curvature, lowest, highest});
      }
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
      const Samples::Motion& m = motions[j][k];
      const int joint = p.joints[j].joint;
      known = known && std::isfinite(m.value + m.slope + m.curvature);
      data->qpos[model.jnt_qposadr[joint]] = m.value;
      data->qvel[model.jnt_dofadr[joint]] = m.slope;
      data->qacc[model.jnt_dofadr[joint]] = m.curvature;
    }
    if (known) mj_inverse(free.get(), data.get());
    for (std::size_t j = 0; j < p.joints.size(); ++j) {
      const int joint = p.joints[j].joint;
      const bool borne = !motions[j].empty() && AtStop(model, joint, motions[j][k]);
      torques[j].push_back(known && !borne ? data->qfrc_inverse[model.jnt_dofadr[joint]] : kNaN);
    }
  }
  return torques;
}

}  // namespace gapscope
