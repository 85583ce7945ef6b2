#include "src/export/target.h"

namespace gapscope {

ExportTarget Target_mujoco() { return {.name = "mujoco", .what = "MuJoCo 4 with the plugin library", .plugins = true}; }

}  // namespace gapscope
