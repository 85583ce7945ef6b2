#include "src/report/version.h"

#include <mujoco/mujoco.h>

namespace gapscope {

std::string GapscopeVersion() { return GAPSCOPE_VERSION; }
std::string MujocoVersion() { return mj_versionString(); }
std::string VersionText() { return "gapscope " + GapscopeVersion() + " (MuJoCo " + MujocoVersion() + ")"; }

}  // namespace gapscope
