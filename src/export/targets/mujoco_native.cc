#include "src/export/target.h"

namespace gapscope {

// Source: MuJoCo 4.0.1 XML reference.
ExportTarget Target_mujoco_native() { return {.name = "mujoco_native", .what = "MuJoCo 4 without plugins"}; }

}  // namespace gapscope
