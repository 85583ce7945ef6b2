#include "src/export/isaaclab.h"

namespace gapscope {

// Source: the wheel isaaclab 3.0.0, actuators/actuator_base_cfg.py, whose older names go in 4.0, and
// sim/simulation_cfg.py.
ExportTarget Target_isaaclab() {
  return {
      .name = "isaaclab", .what = "Isaac Lab 3.0", .has = IsaacLabFeatures(), .files = [](const TargetInput& input) {
        return WriteIsaacLab(
            input, {"3.0", "actuator_effort_limit", "joint_effort_limit", ", use_newton_actuators=False", "_index"});
      }};
}

}  // namespace gapscope
