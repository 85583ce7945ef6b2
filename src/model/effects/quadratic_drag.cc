#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_quadratic_drag() {
  return {
      .name = "quadratic_drag",
      .place = EffectPlace::kJoint,
      .parameters =
          {
              {.key = "drag_n_m_s2_per_rad2",
               .unit = "N m s^2/rad^2",
               .scale = ScaleKind::kDrag,
               .neutral = 0,
               .low = 0,
               .high = 2,
               .trials = {0.03, 0.1, 0.4},
               .start = 0.05},
          },
      .meaning = "drag with the square of speed",
      .signature = "speed squared",
      .told_apart = "fast plateaus",
      .partners = {"torque_speed_curve"},
      .of_motion = true,
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddFrictionTerm(on, "quadratic_n_m_s2_per_rad2", names[0]));
        return Ok();
      },
  };
}

}  // namespace gapscope
