#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_gravity_offset() {
  return {
      .name = "gravity_offset",
      .place = EffectPlace::kJoint,
      .parameters =
          {
              {.key = "torque_n_m",
               .unit = "N m",
               .scale = ScaleKind::kTorque,
               .neutral = 0,
               .low = 0,
               .high = 2,
               .trials = {0.1, 0.3},
               .start = 0.1},
              {.key = "rest_rad",
               .unit = "rad",
               .role = ParameterRole::kPlace,
               .scale = ScaleKind::kOne,
               .neutral = 0,
               .low = -3.2,
               .high = 3.2,
               .trials = {0, 1.57, 3.14, -1.57},
               .start = 0,
               .with = Parameter::With::kAngle},
          },
      .meaning = "an unbalanced mass",
      .signature = "sine of the angle",
      .told_apart = "tilt the rig",
      .partners = {"cable_spring", "torque_bias"},
      .of_motion = true,
      .contains = {{.effect = "torque_bias", .exactly = false}},
      .unlikely_beside = "cable_spring",
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddSpringTerm(on, "gravity_n_m", names[0]));
        GS_RETURN_IF_ERROR(structure.AddSpringTerm(on, "gravity_rest_rad", names[1]));
        return Ok();
      },
  };
}

}  // namespace gapscope
