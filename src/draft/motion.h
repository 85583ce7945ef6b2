// How the joints of a log move, and the torque that the model says it takes.
#ifndef GAPSCOPE_DRAFT_MOTION_H_
#define GAPSCOPE_DRAFT_MOTION_H_

#include <mujoco/mujoco.h>

#include <vector>

#include "src/draft/scaling.h"

namespace gapscope {

// Angle, speed and acceleration of every joint of the pairing at the sampled rows, log after log, SI; empty: not
// measured.
using Motions = std::vector<std::vector<Samples::Motion>>;

inline constexpr double kHalfWidth_s = 0.03;  // of the parabolas that give speed and acceleration
// How late a command is looked for.
inline constexpr double kLatest_s = 0.08, kLagStep_s = 0.004;

Motions MotionsOf(const std::vector<const Samples*>& logs, const std::vector<Guess>& guesses, const Pairing& pairing,
                  const Scalings& scalings, double half_width_s = kHalfWidth_s);

// Torque at each joint that the motion takes, at every sampled row; NaN where the motion is not known, or
// the joint is at an end of its range. Unmeasured joints stand still.
std::vector<std::vector<double>> TorquesOf(const mjModel& model, const Pairing& pairing, const Motions& motions);

}  // namespace gapscope

#endif  // GAPSCOPE_DRAFT_MOTION_H_
