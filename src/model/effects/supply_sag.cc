#include "src/model/effects/catalogue.h"

namespace gapscope {

Effect Effect_supply_sag() {
  return {
      .name = "supply_sag",
      .place = EffectPlace::kMotor,
      .parameters =
          {
              {.key = "time_constant_s",
               .unit = "s",
               .role = ParameterRole::kTime,
               .scale = ScaleKind::kOne,
               .neutral = 0.3,
               .low = 0.05,
               .high = 3,
               .trials = {0.1, 0.4},
               .start = 0.3},
              {.key = "sag_fraction",
               .unit = "1",
               .scale = ScaleKind::kOne,
               .neutral = 0,
               .low = 0,
               .high = 4,
               .trials = {0.3, 1.5},
               .start = 0.3},
              {.key = "limit_n_m",
               .unit = "N m",
               .scale = ScaleKind::kTorque,
               .neutral = 5,
               .low = 0.05,
               .high = 5,
               .trials = {1.2, 0.6},
               .start = 0.8},
          },
      .meaning = "the drive's ceiling falls under load",
      .signature = "the limit falls with load and time",
      .told_apart = "logged voltage",
      .partners = {"torque_limit", "torque_speed_curve"},
      .contains = {{.effect = "torque_limit"}},
      // A little higher, falling by a third, fast or slowly.
      .starts_from = {.effect = "torque_limit",
                      .starts = {{{.value = 0.15}, {.value = 0.3}, {.of_simpler = 1.2}},
                                 {{.value = 0.8}, {.value = 0.3}, {.of_simpler = 1.2}}}},
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        GS_RETURN_IF_ERROR(structure.AddMotorTerm(on, "sag_time_constant_s", names[0]));
        GS_RETURN_IF_ERROR(structure.AddMotorTerm(on, "sag_fraction", names[1]));
        GS_RETURN_IF_ERROR(structure.AddMotorTerm(on, "torque_limit_n_m", names[2]));
        return Ok();
      },
  };
}

}  // namespace gapscope
