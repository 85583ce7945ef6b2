#include "src/export/isaaclab.h"

namespace gapscope {

// Source: isaac-sim/IsaacLab e579469, source/isaaclab/isaaclab/actuators/actuator_base_cfg.py.
ExportTarget Target_isaaclab23() {
  return {
      .name = "isaaclab23", .what = "Isaac Lab 2.3", .has = IsaacLabFeatures(), .files = [](const TargetInput& input) {
        return WriteIsaacLab(input, {"2.3", "effort_limit", "effort_limit_sim"});
      }};
}

}  // namespace gapscope
