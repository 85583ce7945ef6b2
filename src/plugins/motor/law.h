// The laws of a gapscope.motor: what its first input means, and whether it feeds back the joint's position.
#ifndef GAPSCOPE_PLUGINS_MOTOR_LAW_H_
#define GAPSCOPE_PLUGINS_MOTOR_LAW_H_

#include <string_view>

#include "src/plugins/common/parameters.h"

namespace gapscope::plugins {

inline constexpr const char* kMotorName = "gapscope.motor";

enum class MotorLaw { kPosition, kTorque, kCurrent, kVoltage, kDuty, kAffine };

// What an actuator of the instance carries.
enum MotorRole { kTarget, kVelocity, kTorque, kCurrent, kVoltage, kFeedforward, kSupply, kEnable, kRoles };
inline constexpr const char* kRoleNames[kRoles] = {"target",  "velocity",    "torque", "current",
                                                   "voltage", "feedforward", "supply", "enable"};

struct LawTraits {
  const char* name;  // as the attribute `law` spells it
  MotorLaw law;
  MotorRole command;          // the input that it follows
  const char* position_gain;  // its parameter that feeds back the position; empty: none does
};
// The first one is the default.
inline constexpr LawTraits kLaws[] = {
    {"position", MotorLaw::kPosition, kTarget, "kp"}, {"torque", MotorLaw::kTorque, kTorque, ""},
    {"current", MotorLaw::kCurrent, kCurrent, ""},    {"voltage", MotorLaw::kVoltage, kVoltage, ""},
    {"duty", MotorLaw::kDuty, kTarget, "duty_gain"},  {"affine", MotorLaw::kAffine, kTarget, "bias1"}};

// The law of that name, the default for an empty one; null: there is none.
inline const LawTraits* FindLaw(std::string_view name) {
  if (name.empty()) return &kLaws[0];
  for (const LawTraits& law : kLaws) {
    if (name == law.name) return &law;
  }
  return nullptr;
}

}  // namespace gapscope::plugins

#endif  // GAPSCOPE_PLUGINS_MOTOR_LAW_H_
