// Drives with laws (drive_laws.h) in what is written for mjlab.
#ifndef GAPSCOPE_EXPORT_MJLAB_LAWS_H_
#define GAPSCOPE_EXPORT_MJLAB_LAWS_H_

#include <string>
#include <vector>

#include "src/export/target.h"

namespace gapscope {

// LAWS, and mjlab's actuator that has them; empty: no drive has a law.
std::string MjlabLaws(const TargetInput& input);
// Of an event: lines that give environments the arguments that vary. `drives`: the entity's actuators, in their order.
std::string DrawnMjlabLaws(const TargetInput& input, const std::vector<std::string>& drives);

}  // namespace gapscope

#endif  // GAPSCOPE_EXPORT_MJLAB_LAWS_H_
