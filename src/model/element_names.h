// Names of a compiled model's elements.
#ifndef GAPSCOPE_MODEL_ELEMENT_NAMES_H_
#define GAPSCOPE_MODEL_ELEMENT_NAMES_H_

#include <mujoco/mujoco.h>

#include <string>
#include <vector>

namespace gapscope {

// Empty: no such element (id -1), or it has no name.
std::string NameOf(const mjModel& model, mjtObj type, int id);
// Of all elements that have one. Types: joint, body, tendon, actuator, sensor, numeric.
std::vector<std::string> ElementNames(const mjModel& model, mjtObj type);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_ELEMENT_NAMES_H_
