// What the experiment adds to the MJCF before anything else happens to it: actuators, a stand for floating bodies, and
// sensors of the poses that are measured.
#ifndef GAPSCOPE_MODEL_ADD_ACTUATORS_H_
#define GAPSCOPE_MODEL_ADD_ACTUATORS_H_

#include "src/core/mujoco_handles.h"
#include "src/experiment/experiment.h"

namespace gapscope {

// Changes a spec that has not been compiled. Errors, with file:line: an actuator whose name the MJCF has already, or on
// a joint that is not there or no hinge or slide; a body to hold that is not there or has no free joint; a pose of a
// body or a site that is not there; a command for an actuator that neither has.
Status AddToSpec(Experiment* experiment, mjSpec* spec);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_ADD_ACTUATORS_H_
