#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_torque_limit() {
  return {
      .name = "torque_limit",
      .place = EffectPlace::kMotor,
      .parameters =
          {
              {.key = "limit_n_m",
               .unit = "N m",
               .scale = ScaleKind::kTorque,
               .neutral = 2,
               .low = 0.02,
               .high = 2,
               // A drive at its limit falls behind: what the nominal model would give there is many times the limit.
               .trials = {0.85, 0.65, 0.45, 0.25, 0.12, 0.06},
               .start = 0.7},
              {.key = "softness",
               .unit = "1",
               .role = ParameterRole::kShape,
               .scale = ScaleKind::kOne,
               .neutral = 0,
               .low = 0,
               .high = 0.3,
               .start = 0.05},
          },
      .meaning = "the torque cannot exceed a level; its corner may be round",
      .signature = "flat top, at standstill too",
      .told_apart = "big steps at low speed",
      .partners = {"torque_speed_curve", "supply_sag"},
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddMotorTerm(on, "torque_limit_n_m", names[0]));
        return structure.AddMotorTerm(on, "limit_softness", names[1]);
      },
  };
}

}  // namespace gapscope
