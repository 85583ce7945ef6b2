// The effects by the names of the project's documents: where each may sit, its parameters, and how a severity (about
// one is clearly visible) becomes parameter values on a given rig and motion.
#ifndef GAPSCOPE_TESTS_TWIN_EFFECTS_H_
#define GAPSCOPE_TESTS_TWIN_EFFECTS_H_

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/twin/plant.h"

namespace gapscope::twin {

// What a case's logs do without any effect: severities are relative to it.
struct Motion {
  double torque_peak_n_m = 0, torque_rms_n_m = 0, power_peak_w = 0;  // at the first joint
  double command_peak = 0;  // what meets a dead zone or a ceiling: N m (joint), V, A
  double angle1_peak_rad = 0, speed1_peak_rad_per_s = 0, speed1_rms_rad_per_s = 0;
  double angle2_peak_rad = 0, speed2_peak_rad_per_s = 0, torque2_rms_n_m = 0;
};

// Where an effect sits. The first joint and the motor are one place for a diagnosis, but have names of their own.
enum class Place { kMotor, kFirst, kSecond, kFirstSignal, kSecondSignal };
std::string PlaceName(Rig rig, Place place);

using Values = std::vector<std::pair<std::string, double>>;

// One effect on one place of one rig.
struct EffectChoice {
  std::string name;
  Place place = Place::kMotor;
  double severity = 1;
  std::uint64_t shape_seed = 0;  // rest angles, periods, friction law ...: the same for every severity
};

struct EffectRange {
  EffectChoice choice;
  double lowest = 0.01, highest = 10;  // severities that make sense
};

// Every effect of the list on every place of `rig` where it makes sense.
std::vector<EffectRange> EffectsOf(Rig rig);

// Adds the effect to the plant. Returns its parameters under the documented names; parameters that the names leave
// open (a friction law's presliding, the supply's depth ...) go to `extra`.
Values AddEffect(const EffectChoice& choice, const Motion& motion, Plant* plant, Values* extra);

// Sets one parameter, "effect.parameter" or "effect@place.parameter" or a base parameter's name; false when unknown.
bool SetParameter(std::string_view name, double value, Plant* plant);
// All names that SetParameter takes for a rig.
std::vector<std::string> ParameterNames(Rig rig);

// Whether two effects cannot be told apart by construction or overwrite each other, so that they make no pair.
bool Clash(Rig rig, const EffectChoice& a, const EffectChoice& b);

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_EFFECTS_H_
