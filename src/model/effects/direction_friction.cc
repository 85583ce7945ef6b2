#include "src/model/effects/catalogue.h"

namespace gapscope {

// The same name on a joint: dry friction differs by direction.
Effect Effect_direction_friction() {
  return {
      .name = "direction_asymmetry",
      .place = EffectPlace::kJoint,
      .parameters =
          {
              {.key = "friction_positive_n_m",
               .unit = "N m",
               .scale = ScaleKind::kTorque,
               .neutral = 0,
               .low = 0,
               .high = 1,
               .trials = {0, 0.05},
               .start = 0.02},
              {.key = "friction_negative_n_m",
               .unit = "N m",
               .scale = ScaleKind::kTorque,
               .neutral = 0,
               .low = 0,
               .high = 1,
               .trials = {0, 0.05},
               .start = 0.02},
          },
      .meaning = "dry friction differs by direction",
      .signature = "friction differs by direction",
      .told_apart = "both directions",
      .partners = {"torque_bias", "coulomb_friction"},
      .of_motion = true,
      .character = EffectCharacter::kDryFriction,
      .contains = {{.effect = "coulomb_friction"}, {.effect = "torque_bias"}},
      .starts_from = {.effect = "coulomb_friction",
                      .starts = {{{.of_simpler = 1.3}, {.of_simpler = 0.7}},
                                 {{.of_simpler = 0.7}, {.of_simpler = 1.3}}}},
      .same_but_constant = "coulomb_friction",
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddFrictionTerm(on, "friction_positive_n_m", names[0]));
        return structure.AddFrictionTerm(on, "friction_negative_n_m", names[1]);
      },
  };
}

}  // namespace gapscope
