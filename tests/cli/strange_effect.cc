// An effect that no other file of this project names: what it takes to add one to a program of one's own.
#include "src/model/effects/catalogue.h"

namespace gapscope {
namespace {

const bool kAdded = [] {
  AddToCatalogue({
      .name = "creaking_hinge",
      .place = EffectPlace::kDrivenJoint,
      .parameters = {{.key = "loop_n_m",
                      .unit = "N m",
                      .scale = ScaleKind::kTorque,
                      .low = 0,
                      .high = 1,
                      .trials = {0.05},
                      .start = 0.05}},
      .meaning = "a hinge that creaks: its torque depends on where it came from",
      .signature = "a loop over the angle, at any speed",
      .told_apart = "slow triangle",
      .partners = {"coulomb_friction"},
      .character = EffectCharacter::kDryFriction,
      .apply = [](Structure& structure, const std::string& on, const std::vector<std::string>& names) -> Status {
        return structure.AddSpringTerm(on, "hysteresis_n_m", names[0]);
      },
  });
  return true;
}();

}  // namespace
}  // namespace gapscope
