#include "src/model/effects/catalogue.h"

namespace gapscope {

// On the motor the gain differs by the sign of the torque; on a voltage drive it may differ by the sign of the voltage
// instead, which leaves the back-EMF's damping as it is.
Effect Effect_direction_asymmetry() {
  return {
      .name = "direction_asymmetry",
      .place = EffectPlace::kMotor,
      .parameters =
          {
              {.key = "asymmetry",
               .unit = "1",
               .scale = ScaleKind::kOne,
               .neutral = 0,
               .low = -0.6,
               .high = 0.6,
               .trials = {-0.1, 0.1},
               .start = 0},
              {.key = "command_share",
               .unit = "1",
               .role = ParameterRole::kShape,
               .scale = ScaleKind::kOne,
               .neutral = 0,
               .low = 0,
               .high = 1,
               .start = 0.3,
               .voltage_only = true},
          },
      .meaning = "the drive's gain differs by the sign of the torque",
      .signature = "response differs by direction",
      .told_apart = "both directions",
      .partners = {"torque_bias"},
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddMotorTerm(on, "asymmetry", names[0] + "*(1-" + names[1] + ")"));
        return structure.AddMotorTerm(on, "command_asymmetry", names[0] + "*" + names[1]);
      },
  };
}

}  // namespace gapscope
