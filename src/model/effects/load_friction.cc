#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_load_friction() {
  return {
      .name = "load_friction",
      .place = EffectPlace::kDrivenJoint,
      .parameters =
          {
              {.key = "coefficient",
               .unit = "1",
               .scale = ScaleKind::kOne,
               .neutral = 0,
               .low = 0,
               .high = 0.9,
               .trials = {0.05, 0.15, 0.4},
               .start = 0.1},
          },
      .meaning = "dry friction in proportion to the transmitted torque",
      .signature = "friction grows with torque",
      .told_apart = "two loads",
      .partners = {"coulomb_friction", "quadratic_drag"},
      .character = EffectCharacter::kDryFriction,
      .actuator_stage = 4,
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddFrictionTerm(on, "load_coefficient", names[0]));
        return Ok();
      },
  };
}

}  // namespace gapscope
