#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_actuator_lag() {
  return {
      .name = "actuator_lag",
      .place = EffectPlace::kMotor,
      .parameters =
          {
              {.key = "time_constant_s",
               .unit = "s",
               .role = ParameterRole::kTime,
               .scale = ScaleKind::kOne,
               .neutral = 0,
               .low = 0,
               .high = 0.15,
               .trials = {0.002, 0.006, 0.02, 0.06},
               .start = 0.004},
              {.key = "second_pole_share",
               .unit = "1",
               .role = ParameterRole::kShape,
               .scale = ScaleKind::kOne,
               .neutral = 0,
               .low = 0,
               .high = 0.5,
               .start = 0.1},
          },
      .meaning = "torque follows its request with a lag of two poles: the time constant is their sum",
      .signature = "phase saturates, gain rolls off",
      .told_apart = "steps, high frequency",
      .partners = {"command_delay", "torque_delay"},
      .of_time = true,
      .actuator_stage = 2,
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddMotorTerm(on, "time_constant_s", names[0] + "*(1-" + names[1] + ")"));
        return structure.AddMotorTerm(on, "second_time_constant_s", names[0] + "*" + names[1]);
      },
  };
}

}  // namespace gapscope
