// Whether two compiled models move alike: the check of a model that was written as text and read back.
#ifndef GAPSCOPE_MODEL_SAME_MODEL_H_
#define GAPSCOPE_MODEL_SAME_MODEL_H_

#include <mujoco/mujoco.h>

#include <string>

namespace gapscope {

// The first thing that differs in what bodies, joints, tendons, actuators, plugins and their numbers are, by MuJoCo's
// name for it; "": nothing. Numbers may differ by a relative 1e-4: text holds them to about 1e-6, and MuJoCo derives
// others from them.
std::string DifferenceOf(const mjModel& a, const mjModel& b);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_SAME_MODEL_H_
