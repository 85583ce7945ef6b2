#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_cable_spring() {
  return {
      .name = "cable_spring",
      .place = EffectPlace::kJoint,
      .parameters =
          {
              {.key = "stiffness_n_m_per_rad",
               .unit = "N m/rad",
               .scale = ScaleKind::kStiffness,
               .neutral = 0,
               .low = 0,
               .high = 3,
               .trials = {0.05, 0.2, 0.6},
               .start = 0.1},
              {.key = "rest_rad",
               .unit = "rad",
               .role = ParameterRole::kPlace,
               .scale = ScaleKind::kAngle,
               .neutral = 0,
               .low = -4,
               .high = 4,
               .reach_rad = 3.2,
               .trials = {-1, 0, 1},
               .start = 0,
               .with = Parameter::With::kRest},
              // No trials: screened as the linear cable, and free in every fit.
              {.key = "stiffness_cubic_n_m_per_rad3",
               .unit = "N m/rad^3",
               .role = ParameterRole::kShape,
               .scale = ScaleKind::kCubic,
               .neutral = 0,
               .low = 0,
               .high = 3,
               .trials = {},
               .start = 0,
               .with = Parameter::With::kCubic,
               .takes_over = true},
          },
      .meaning = "a cable pulls to a rest angle",
      .signature = "linear in angle about a rest angle",
      .told_apart = "slow sweep of the range",
      .partners = {"gravity_offset", "torque_bias", "cogging"},
      .of_motion = true,
      .base_term = BaseTerm::kSpring,
      .contains = {{.effect = "torque_bias", .exactly = false}},
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddSpringTerm(on, "stiffness_n_m_per_rad", names[0]));
        GS_RETURN_IF_ERROR(structure.AddSpringTerm(on, "rest_rad", names[1]));
        GS_RETURN_IF_ERROR(structure.AddSpringTerm(on, "cubic_n_m_per_rad3", names[2]));
        return Ok();
      },
  };
}

}  // namespace gapscope
