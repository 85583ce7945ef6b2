// Whether a motor's command column is its input or the torque behind its gear.
#ifndef GAPSCOPE_DRAFT_TORQUE_SCALE_H_
#define GAPSCOPE_DRAFT_TORQUE_SCALE_H_

#include <mujoco/mujoco.h>

#include <vector>

#include "src/draft/scaling.h"

namespace gapscope {

// An MJCF's motor multiplies its input by gear and gain. Logs hold that input, or the torque at the joint: of the two
// the one that the motion takes by the model's inverse dynamics is taken. A column with the wrong sign gets the other.
void FindTorqueScales(const mjModel& model, const Samples& samples, const std::vector<Guess>& guesses,
                      const Pairing& pairing, Scalings* scalings);

}  // namespace gapscope

#endif  // GAPSCOPE_DRAFT_TORQUE_SCALE_H_
