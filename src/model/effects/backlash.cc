#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_backlash() {
  return {
      .name = "backlash",
      .place = EffectPlace::kDrivenJoint,
      .parameters =
          {
              {.key = "gap_rad",
               .unit = "rad",
               .scale = ScaleKind::kAngle,
               .neutral = 0,
               .low = 0,
               .high = 0.5,
               .trials = {0.005, 0.02, 0.06},
               .start = 0.01},
              {.key = "motor_share",
               .unit = "1",
               .scale = ScaleKind::kOne,
               .neutral = 0.5,
               .low = 0.15,
               .high = 0.85,
               .start = 0.5},
              // Of the flanks: how much of a blow comes back. 1: nothing.
              {.key = "flank_damping_ratio",
               .unit = "1",
               .role = ParameterRole::kShape,
               .scale = ScaleKind::kOne,
               .neutral = 1,
               .low = 0.15,
               .high = 1,
               .start = 0.5},
          },
      .meaning = "a gap between motor and load",
      .signature = "gap at reversal, any speed",
      .told_apart = "small amplitude",
      .partners = {"joint_compliance", "coulomb_friction"},
      .character = EffectCharacter::kSecondMass,
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        return structure.AddSplit(
            {.joint = on, .share = names[1], .stiffness = "", .damping = names[2], .gap = names[0]});
      },
  };
}

}  // namespace gapscope
