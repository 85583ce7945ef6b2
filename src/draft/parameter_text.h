// The sections `parameters:` and `set:` of a draft: damping, armature and what else the MJCF has of each joint, gains
// of its actuators and of those that the draft adds.
#ifndef GAPSCOPE_DRAFT_PARAMETER_TEXT_H_
#define GAPSCOPE_DRAFT_PARAMETER_TEXT_H_

#include <mujoco/mujoco.h>

#include <string>
#include <vector>

#include "src/draft/pairing.h"
#include "src/draft/servo_gains.h"

namespace gapscope {

// `gains`: of the actuators that the draft adds; empty: it adds none.
std::string ParameterText(const mjModel& model, const Pairing& pairing, const std::vector<ServoGains>& gains);

}  // namespace gapscope

#endif  // GAPSCOPE_DRAFT_PARAMETER_TEXT_H_
