#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_command_delay() {
  return {
      .name = "command_delay",
      .place = EffectPlace::kMotor,
      .parameters =
          {
              {.key = "delay_s",
               .unit = "s",
               .role = ParameterRole::kTime,
               .scale = ScaleKind::kOne,
               .neutral = 0,
               .low = 0,
               .high = 0.08,
               .trials = {0.002, 0.006, 0.02},
               .start = 0.004},
          },
      .meaning = "every command acts late",
      .signature = "phase grows with frequency, flat gain",
      .told_apart = "steps, high frequency",
      .partners = {"actuator_lag", "sensor_delay"},
      .of_time = true,
      .host = "send commands later",
      .actuator_stage = 1,
      .same_on_one_signal = "sensor_delay",
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        // A late command is a shift of the log, which the host does exactly; an exported model needs the motor's own
        // delay.
        if (structure.form != Structure::Form::kReplay) return structure.AddMotorTerm(on, "command_delay_s", names[0]);
        structure.command_delay[on] = names[0];
        return Ok();
      },
  };
}

}  // namespace gapscope
