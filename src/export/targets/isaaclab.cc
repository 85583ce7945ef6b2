#include "src/export/isaaclab.h"

namespace gapscope {

// Source: isaac-sim/IsaacLab, develop of 2026, source/isaaclab/isaaclab/actuators/actuator_base_cfg.py, whose older
// names go in 4.0.
ExportTarget Target_isaaclab() {
  return {
      .name = "isaaclab", .what = "Isaac Lab 3.0", .has = IsaacLabFeatures(), .files = [](const TargetInput& input) {
        return WriteIsaacLab(input, {"3.0", "actuator_effort_limit", "joint_effort_limit"});
      }};
}

}  // namespace gapscope
