// How large a rig's torques, angles, speeds and commands are, by its logs: what effects' bounds grow with.
#ifndef GAPSCOPE_REPLAY_SCALES_H_
#define GAPSCOPE_REPLAY_SCALES_H_

#include <vector>

#include "src/experiment/recording.h"
#include "src/model/model.h"

namespace gapscope {

// Largest torque, angle, speed and command on each joint and actuator over the recordings, along the measured motion of
// the nominal model: the rig's own size.
ScaleTable EstimateScales(const Model& model, const std::vector<Recording>& recordings);

}  // namespace gapscope

#endif  // GAPSCOPE_REPLAY_SCALES_H_
