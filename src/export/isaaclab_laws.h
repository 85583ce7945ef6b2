// Drives with laws (drive_laws.h) in what is written for Isaac Lab.
#ifndef GAPSCOPE_EXPORT_ISAACLAB_LAWS_H_
#define GAPSCOPE_EXPORT_ISAACLAB_LAWS_H_

#include <string>

#include "src/export/target.h"

namespace gapscope {

// LAWS, the actuator that has them and its configuration, and the event that draws an argument.
std::string IsaacLabLaws(const TargetInput& input);
// Terms of EVENTS: each argument that may be drawn alone, from its parameter's 95 % range.
std::string IsaacLabLawEvents(const TargetInput& input);

}  // namespace gapscope

#endif  // GAPSCOPE_EXPORT_ISAACLAB_LAWS_H_
