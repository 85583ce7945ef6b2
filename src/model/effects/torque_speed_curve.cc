#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_torque_speed_curve() {
  return {
      .name = "torque_speed_curve",
      .place = EffectPlace::kMotor,
      .parameters =
          {
              {.key = "power_w",
               .unit = "W",
               .scale = ScaleKind::kPower,
               .neutral = 2,
               .low = 0.01,
               .high = 2,
               .trials = {0.6, 0.35, 0.2, 0.1, 0.05},
               .start = 0.3},
          },
      .meaning = "constant power: the torque limit falls with speed",
      .signature = "limit falls with speed",
      .told_apart = "high speed and torque together",
      .partners = {"torque_limit", "quadratic_drag"},
      .actuator_stage = 3,
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddMotorTerm(on, "power_w", names[0]));
        return Ok();
      },
  };
}

}  // namespace gapscope
