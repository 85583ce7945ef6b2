#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_torque_constant_droop() {
  return {
      .name = "torque_constant_droop",
      .place = EffectPlace::kMotor,
      .parameters =
          {
              {.key = "loss_at_peak",
               .unit = "1",
               .scale = ScaleKind::kOne,
               .neutral = 0,
               .low = 0,
               .high = 2,  // logs may reach a part of the peak; without a stated one it is a guess, late by half
               .trials = {0.1, 0.3, 0.5},
               .start = 0.1},
              {.key = "exponent",
               .unit = "1",
               .role = ParameterRole::kShape,
               .scale = ScaleKind::kOne,
               .neutral = 1,
               .low = 1,
               .high = 3,
               .start = 1.3},
          },
      .meaning = "less torque per ampere at high current",
      .signature = "torque falls short at high current",
      .told_apart = "stalls at several levels",
      .partners = {"torque_limit"},
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddMotorTerm(on, "droop_at_peak", names[0]));
        GS_RETURN_IF_ERROR(structure.AddMotorTerm(on, "droop_exponent", names[1]));
        return structure.AddMotorTerm(on, "droop_reference_n_m", ScaleName(on, RigSize::kPeak));
      },
  };
}

}  // namespace gapscope
