#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_torque_delay() {
  return {
      .name = "torque_delay",
      .place = EffectPlace::kServo,
      .parameters =
          {
              {.key = "delay_s",
               .unit = "s",
               .role = ParameterRole::kTime,
               .scale = ScaleKind::kOne,
               .neutral = 0,
               .low = 0,
               .high = 0.04,
               .trials = {0.001, 0.003, 0.01},
               .start = 0.002},
          },
      .meaning = "the servo's torque acts late, inside its own loop",
      .signature = "the same phase around the servo's own loop",
      .told_apart = "loop gain, ringing",
      .partners = {"command_delay", "actuator_lag"},
      .of_time = true,
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddMotorTerm(on, "torque_delay_s", names[0]));
        return Ok();
      },
  };
}

}  // namespace gapscope
