// Actuator configurations of Isaac Lab, whose names differ by version.
#ifndef GAPSCOPE_EXPORT_ISAACLAB_H_
#define GAPSCOPE_EXPORT_ISAACLAB_H_

#include <string>
#include <vector>

#include "src/export/target.h"

namespace gapscope {

// Names of ActuatorBaseCfg's members: what limits the torque of a drive that Isaac Lab computes, and of one that the
// physics engine computes. python_actuators: arguments without which SimulationCfg takes no actuator in Python.
// by_index: the end of the names of what writes to some environments.
struct IsaacLabNames {
  std::string version, explicit_limit, implicit_limit, python_actuators, by_index;
};

// What its joints have, and its actuators.
NativeFeatures IsaacLabFeatures();
// gapscope_isaaclab.py. Errors: a drive or a joint that it has no form for.
Result<std::vector<TargetFile>> WriteIsaacLab(const TargetInput& input, const IsaacLabNames& names);

}  // namespace gapscope

#endif  // GAPSCOPE_EXPORT_ISAACLAB_H_
