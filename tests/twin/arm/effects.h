// The effects of a twin arm by the names of the project's documents, on any joint, drive or sensor, on all drives or
// sensors, on the last body, on the mount. What acts on one joint or drive is drawn as on the first joint of the rig
// `joint` (../effects.h), with that joint's own motion.
#ifndef GAPSCOPE_TESTS_TWIN_ARM_EFFECTS_H_
#define GAPSCOPE_TESTS_TWIN_ARM_EFFECTS_H_

#include <string>
#include <vector>

#include "tests/twin/arm/arm.h"
#include "tests/twin/effects.h"
#include "tests/twin/random.h"

namespace gapscope::twin {

enum class ArmPlace { kJoint, kDrive, kSignal, kBody, kModel };
inline constexpr int kAllJoints = -1;

struct ArmChoice {
  std::string name;
  ArmPlace place = ArmPlace::kJoint;
  int joint = 0;  // or kAllJoints: all drives or sensors, with one size
  double severity = 1;
  std::uint64_t shape_seed = 0;
};
// The label's `on`: joint, actuator, signal, body, `all` or `model`.
std::string ArmPlaceName(ArmRig rig, const ArmChoice& choice);

struct ArmRange {
  ArmChoice choice;
  double lowest = 0.01, highest = 10;  // severities that make sense
  // A log that is late as a whole is one whose targets are: made where it is asked for, by name and place, never drawn.
  bool only_asked() const { return choice.place == ArmPlace::kSignal && choice.joint == kAllJoints; }
};
std::vector<ArmRange> ArmEffectsOf(ArmRig rig);
// One of them, with a seed of its shape: of that NAME or NAME@ON where it is not empty. False: there is none such.
bool DrawArmEffect(ArmRig rig, const std::string& wanted, Random* random, ArmRange* drawn);

// As AddEffect, with every joint's motion.
Values AddArmEffect(const ArmChoice& choice, const std::vector<Motion>& motions, ArmPlant* plant, Values* extra);
// As Clash.
bool ArmClash(const ArmChoice& a, const ArmChoice& b);

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_ARM_EFFECTS_H_
