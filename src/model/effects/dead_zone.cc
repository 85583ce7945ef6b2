#include "src/model/effects/catalogue.h"

namespace gapscope {

// The half width's key carries the unit of what is dead: the voltage, the current, or a servo's torque.
Effect Effect_dead_zone() {
  return {
      .name = "dead_zone",
      .place = EffectPlace::kMotor,
      .parameters =
          {
              {.key = "half_width",
               .unit = "command",
               .scale = ScaleKind::kCommand,
               .neutral = 0,
               .low = 0,
               .high = 0.8,
               .trials = {0.02, 0.07, 0.2},
               .start = 0.03},
          },
      .meaning = "no torque near zero command",
      .signature = "no torque near zero command",
      .told_apart = "slow ramp of the command",
      .partners = {"coulomb_friction"},
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        return structure.AddMotorTerm(on, "dead_zone", names[0]);
      },
  };
}

}  // namespace gapscope
