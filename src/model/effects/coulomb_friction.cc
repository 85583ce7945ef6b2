#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_coulomb_friction() {
  return {
      .name = "coulomb_friction",
      .title = "Coulomb friction",
      .place = EffectPlace::kJoint,
      .parameters =
          {
              {.key = "friction_n_m",
               .unit = "N m",
               .scale = ScaleKind::kTorque,
               .neutral = 0,
               .low = 0,
               .high = 1,
               .trials = {0.01, 0.04, 0.15},
               .start = 0.03},
          },
      .meaning = "dry friction of constant level",
      .signature = "sign of speed, amplitude-dependent",
      .told_apart = "slow triangle, coasting",
      .partners = {"dead_zone", "stribeck_friction", "load_friction"},
      .of_motion = true,
      .character = EffectCharacter::kDryFriction,
      .base_term = BaseTerm::kDryFriction,
      .actuator_stage = 5,
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddFrictionTerm(on, "friction_n_m", names[0]));
        return Ok();
      },
  };
}

}  // namespace gapscope
