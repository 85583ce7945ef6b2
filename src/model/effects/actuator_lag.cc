#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_actuator_lag() {
  return {
      .name = "actuator_lag",
      .place = EffectPlace::kMotor,
      .parameters = {
          {.key = "time_constant_s", .unit = "s", .scale = ScaleKind::kOne, .neutral = 0, .low = 0, .high = 0.15, .trials = {0.002, 0.006, 0.02, 0.06}, .start = 0.004},
      },
      .meaning = "torque follows its request with a first-order lag",
      .signature = "phase saturates, gain rolls off",
      .told_apart = "steps, high frequency",
      .partners = {"command_delay", "torque_delay"},
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddMotorTerm(on, "time_constant_s", names[0]));
        return Ok();
      },
  };
}

}  // namespace gapscope
