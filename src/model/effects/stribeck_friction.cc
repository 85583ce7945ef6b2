#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_stribeck_friction() {
  return {
      .name = "stribeck_friction",
      .title = "Stribeck friction",
      .place = EffectPlace::kJoint,
      .parameters =
          {
              {.key = "friction_n_m",
               .unit = "N m",
               .scale = ScaleKind::kTorque,
               .neutral = 0,
               .low = 0,
               .high = 1,
               .trials = {0.01, 0.04},
               .start = 0.02},
              {.key = "breakaway_n_m",
               .unit = "N m",
               .scale = ScaleKind::kTorque,
               .neutral = 0,
               .low = 0,
               .high = 1.5,
               .trials = {0.02, 0.08},
               .start = 0.05},
              {.key = "stribeck_speed_rad_per_s",
               .unit = "rad/s",
               .scale = ScaleKind::kSpeed,
               .neutral = 0.05,
               .low = 0.001,
               .high = 1,
               .trials = {0.02, 0.1},
               .start = 0.05},
          },
      .meaning = "dry friction with a hump at low speed",
      .signature = "hump at low speed, stick-slip",
      .told_apart = "creep",
      .partners = {"coulomb_friction"},
      .of_motion = true,
      .character = EffectCharacter::kDryFriction,
      // Most dry friction has a hump (Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30, 1994).
      .contains = {{.effect = "coulomb_friction", .usual = true}},
      // A hump over what slides.
      .starts_from = {.effect = "coulomb_friction", .starts = {{{.of_simpler = 0.9}, {.of_simpler = 1.5}, {}}}},
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddFrictionTerm(on, "friction_n_m", names[0]));
        GS_RETURN_IF_ERROR(structure.AddFrictionTerm(on, "breakaway_n_m", names[1]));
        GS_RETURN_IF_ERROR(structure.AddFrictionTerm(on, "stribeck_speed_rad_per_s", names[2]));
        return Ok();
      },
  };
}

}  // namespace gapscope
