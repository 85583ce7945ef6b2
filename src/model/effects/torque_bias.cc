#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_torque_bias() {
  return {
      .name = "torque_bias",
      .place = EffectPlace::kJoint,
      .parameters =
          {
              {.key = "torque_n_m",
               .unit = "N m",
               .scale = ScaleKind::kTorque,
               .neutral = 0,
               .low = -1,
               .high = 1,
               .trials = {-0.05, 0.05},
               .start = 0},
          },
      .meaning = "a constant torque",
      .signature = "constant",
      .told_apart = "both directions",
      .partners = {"cable_spring", "gravity_offset"},
      .of_motion = true,
      .character = EffectCharacter::kConstantTorque,
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddSpringTerm(on, "bias_n_m", names[0]));
        return Ok();
      },
  };
}

}  // namespace gapscope
