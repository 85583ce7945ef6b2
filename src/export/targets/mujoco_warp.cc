#include "src/export/target.h"

namespace gapscope {

// Source: mujoco_warp 4.0 _src/types.py and io.py (put_model refuses plugins of bodies, actuators and sensors),
// forward.py (rungekutta4 leaves the data's time as it is in its stages).
ExportTarget Target_mujoco_warp() {
  return {.name = "mujoco_warp", .what = "MuJoCo Warp 4 (float32)", .has = {.late_in_stages = true}};
}

}  // namespace gapscope
