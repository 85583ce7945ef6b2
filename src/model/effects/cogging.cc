#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_cogging() {
  return {
      .name = "cogging",
      .place = EffectPlace::kDrivenJoint,
      .parameters =
          {
              {.key = "amplitude_n_m",
               .unit = "N m",
               .scale = ScaleKind::kTorque,
               .neutral = 0,
               .low = 0,
               .high = 1,
               .trials = {0.05},
               .start = 0.03},
              {.key = "periods_per_rev",
               .unit = "1",
               .role = ParameterRole::kPlace,
               .scale = ScaleKind::kOne,
               .neutral = 12,
               .low = 1,
               .high = 100,
               .trials = {2,  3,  4,  5,  6,  7,  8,  9,  10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24,
                          25, 26, 27, 28, 29, 30, 31, 32, 33, 34, 35, 36, 37, 38, 39, 40, 42, 44, 48, 56, 64, 72, 84},
               .start = 12},
              {.key = "phase_rad",
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
      .meaning = "torque ripple over the angle",
      .signature = "periodic in angle",
      .told_apart = "constant slow speed",
      .partners = {"cable_spring"},
      .of_motion = true,
      .contains = {{.effect = "gravity_offset"}, {.effect = "cable_spring"}, {.effect = "torque_bias"}},
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddSpringTerm(on, "cogging_n_m", names[0]));
        GS_RETURN_IF_ERROR(structure.AddSpringTerm(on, "cogging_periods_per_rev", names[1]));
        GS_RETURN_IF_ERROR(structure.AddSpringTerm(on, "cogging_phase_rad", names[2]));
        return Ok();
      },
  };
}

}  // namespace gapscope
