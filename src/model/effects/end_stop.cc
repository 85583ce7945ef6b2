#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_end_stop() {
  return {
      .name = "end_stop",
      .place = EffectPlace::kJoint,
      .parameters =
          {
              {.key = "stiffness_n_m_per_rad",
               .unit = "N m/rad",
               .scale = ScaleKind::kStiffness,
               .neutral = 0,
               .low = 0,
               .high = 30,
               .trials = {1, 10},
               .start = 3},
              {.key = "angle_rad",
               .unit = "rad",
               .role = ParameterRole::kPlace,
               .scale = ScaleKind::kAngle,
               .neutral = 1,
               .low = -1,
               .high = 1,
               .trials = {-0.95, -0.8, -0.6, 0.95, 0.8, 0.6},
               .start = 0.8},
          },
      .meaning = "an elastic stop that the joint runs into",
      .signature = "a torque back beyond an angle on one side, none before it",
      .told_apart = "slow moves up to the end of the range and back",
      .partners = {"spring_hardening", "cable_spring"},
      .of_motion = true,
      .of_range = true,
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddSpringTerm(on, "stop_n_m_per_rad", names[0]));
        return structure.AddSpringTerm(on, "stop_rad", names[1]);
      },
  };
}

}  // namespace gapscope
