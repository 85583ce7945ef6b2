#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_spring_hardening() {
  return {
      .name = "spring_hardening",
      .place = EffectPlace::kSpringJoint,
      .parameters =
          {
              {.key = "cubic_n_m_per_rad3",
               .unit = "N m/rad^3",
               .scale = ScaleKind::kCubic,
               .neutral = 0,
               .low = -2,
               .high = 5,
               .trials = {0.1, 0.4, 1},
               .start = 0.1},
          },
      .meaning = "the rig's own spring stiffens with amplitude",
      .signature = "frequency moves with amplitude",
      .told_apart = "two amplitudes",
      .partners = {"joint_compliance"},
      .of_motion = true,
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddSpringTerm(on, "cubic_n_m_per_rad3", names[0]));
        return Ok();
      },
  };
}

}  // namespace gapscope
