// What a gapscope.motor instance is told by its MJCF, parsed and checked once.
#ifndef GAPSCOPE_PLUGINS_MOTOR_MOTOR_CONFIG_H_
#define GAPSCOPE_PLUGINS_MOTOR_MOTOR_CONFIG_H_

#include <mujoco/mujoco.h>

#include <array>
#include <string>

#include "src/plugins/common/parameters.h"
#include "src/plugins/motor/stages.h"

namespace gapscope::plugins {

enum class MotorLaw { kPosition, kTorque, kCurrent, kVoltage, kDuty, kAffine };

// What an actuator of the instance carries.
enum MotorRole { kTarget, kVelocity, kTorque, kCurrent, kVoltage, kFeedforward, kSupply, kEnable, kRoles };

// Live parameters; units, neutral values and ranges in kMotorSpecs, meaning in README.md.
enum MotorParameter {
  kKp,
  kKd,
  kGain,
  kBias0,
  kBias1,
  kBias2,
  kKt,
  kKe,
  kResistance,
  kGear,
  kEfficiencyDrive,
  kEfficiencyBackdrive,
  kDutyGain,
  kDutyDamping,
  kDutyLimit,
  kSupplyV,
  kCommandDelay,
  kTorqueDelay,
  kTimeConstant,
  kSecondTimeConstant,
  kDeadZone,
  kTorqueLimit,
  kPower,
  kGeneratingPower,
  kPeakTorque,
  kRatedSpeed,
  kNoLoadSpeed,
  kGeneratingFactor,
  kSagFraction,
  kSagTimeConstant,
  kDroopAtPeak,
  kDroopReference,
  kDroopExponent,
  kAsymmetry,
  kCommandAsymmetry,
  kLimitSoftness,
  kMotorParameters
};
extern const std::array<ParameterSpec, kMotorParameters> kMotorSpecs;

// All attributes that `<config>` may hold.
extern const char* const kMotorAttributes[];
extern const int kMotorAttributeCount;

struct MotorConfig {
  MotorLaw law = MotorLaw::kPosition;
  int inputs = 1;                      // actuators of the instance, in order of id
  std::array<int, kRoles> input_of{};  // role -> index among the inputs, -1: none
  int command = 0;                     // index of the input that the law follows
  bool dead_zone_on_command = false;
  double max_delay_s = 0;  // 0: no history
  SpeedTable motoring, generating;
  LiveParameters<kMotorParameters> live;

  // Returns an empty text, or one that names the instance, the attribute, what was found, what is allowed, the cure.
  std::string Parse(const mjModel* m, int instance);
};

// Numbers of plugin_state that the instance needs. For `nstate`, which the engine calls while it compiles: names, texts
// and options of the model are there, numbers and actuators are not yet.
int MotorStateSize(const mjModel* m, int instance);

}  // namespace gapscope::plugins

#endif  // GAPSCOPE_PLUGINS_MOTOR_MOTOR_CONFIG_H_
