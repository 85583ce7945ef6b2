#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_sensor_delay() {
  return {
      .name = "sensor_delay",
      .place = EffectPlace::kSignal,
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
      .meaning = "what is measured is logged late",
      .signature = "measured late, motion right",
      .told_apart = "two sensors, torque log",
      .partners = {"command_delay"},
      .of_time = true,
      .host = "delay what the sensor says",
      .same_on_one_signal = "command_delay",
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        structure.signal_delay[on] = names[0];
        return Ok();
      },
  };
}

}  // namespace gapscope
