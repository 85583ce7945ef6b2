#include "src/export/target.h"

#include <algorithm>

#include "src/core/result.h"

namespace gapscope {
namespace {

// Sources: MuJoCo 4.0.1 XML reference; mujoco_warp 4.0 _src/types.py and io.py (put_model refuses plugins of bodies,
// actuators and sensors); mujoco-mjx 3.17 _src/types.py (no DCMOTOR), passive.py and forward.py (delay and polynomials
// are stored and never read).
const ExportTarget kTargets[] = {
    {TargetName::kMujoco, "MuJoCo 4 with the plugin library", true, {}},
    {TargetName::kMujocoNative, "MuJoCo 4 without plugins", false, {}},
    {TargetName::kMujocoWarp, "MuJoCo Warp 4 (float32)", false, {}},
    {TargetName::kMjx,
     "MJX 3.17 and Playground",
     false,
     {.passive_motors = false, .delays = false, .polynomials = false}},
};

}  // namespace

const ExportTarget& TargetOf(TargetName name) {
  const auto found =
      std::find_if(std::begin(kTargets), std::end(kTargets), [&](const auto& target) { return target.name == name; });
  GS_CHECK(found != std::end(kTargets));
  return *found;
}

template <>
std::span<const EnumName<TargetName>> EnumNames<TargetName>() {
  static constexpr EnumName<TargetName> kNames[] = {{TargetName::kMujoco, "mujoco"},
                                                    {TargetName::kMujocoNative, "mujoco_native"},
                                                    {TargetName::kMujocoWarp, "mujoco_warp"},
                                                    {TargetName::kMjx, "mjx"}};
  return kNames;
}

}  // namespace gapscope
