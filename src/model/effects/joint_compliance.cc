#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_joint_compliance() {
  return {
      .name = "joint_compliance",
      .place = EffectPlace::kDrivenJoint,
      .parameters =
          {
              {.key = "stiffness_n_m_per_rad",
               .unit = "N m/rad",
               .scale = ScaleKind::kStiffness,
               .neutral = 3000,
               .low = 0.5,
               .high = 3000,
               .trials = {300, 100, 30, 10, 3},
               .start = 100},
              {.key = "motor_share",
               .unit = "1",
               .scale = ScaleKind::kOne,
               .neutral = 0.5,
               .low = 0.15,
               .high = 0.85,
               .start = 0.5},
              {.key = "damping_ratio",
               .unit = "1",
               .scale = ScaleKind::kOne,
               .neutral = 0.05,
               .low = 0.001,
               .high = 0.5,
               .start = 0.03},
          },
      .meaning = "a spring between motor and load",
      .signature = "resonance, anti-resonance",
      .told_apart = "chirp past it",
      .partners = {"command_delay", "backlash"},
      .character = EffectCharacter::kSecondMass,
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        // Damping in proportion to the stiffness, by the ratio at the rig's own inertia.
        const std::string inertia = ScaleName(on, RigSize::kInertia);
        const std::string damping =
            names[2] + "*2*sqrt(" + names[0] + "*" + inertia + "*" + names[1] + "*(1-" + names[1] + "))";
        return structure.AddSplit(
            {.joint = on, .share = names[1], .stiffness = names[0], .damping = damping, .gap = ""});
      },
  };
}

}  // namespace gapscope
