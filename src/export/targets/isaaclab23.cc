#include "src/export/isaaclab.h"

namespace gapscope {

// Source: the wheel isaaclab 2.3.2.post1, actuators/actuator_base_cfg.py.
ExportTarget Target_isaaclab23() {
  return {
      .name = "isaaclab23", .what = "Isaac Lab 2.3", .has = IsaacLabFeatures(), .files = [](const TargetInput& input) {
        return WriteIsaacLab(input, {"2.3", "effort_limit", "effort_limit_sim", "", ""});
      }};
}

}  // namespace gapscope
