// What a gapscope.motor instance is told by its MJCF, parsed and checked once.
#ifndef GAPSCOPE_PLUGINS_MOTOR_MOTOR_CONFIG_H_
#define GAPSCOPE_PLUGINS_MOTOR_MOTOR_CONFIG_H_

#include <mujoco/mujoco.h>

#include <array>
#include <span>
#include <string>

#include "src/plugins/common/parameters.h"
#include "src/plugins/motor/law.h"
#include "src/plugins/motor/stages.h"

namespace gapscope::plugins {

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
  kFrictionSlope,
  kFrictionLoad,
  kFrictionHump,
  kFrictionHumpSpeed,
  kMotorParameters
};
inline constexpr std::array<ParameterSpec, kMotorParameters> kMotorSpecs = {{
    {"kp", "N m/rad", 0, 0, 1e9},
    {"kd", "N m s/rad", 0, 0, 1e9},
    {"gain", "1", 1, -1e9, 1e9},
    {"bias0", "N m", 0, -1e9, 1e9},
    {"bias1", "N m/rad", 0, -1e9, 1e9},
    {"bias2", "N m s/rad", 0, -1e9, 1e9},
    {"kt", "N m/A", 0, 0, 1e6},
    {"ke", "V s/rad", 0, 0, 1e6},
    {"resistance", "ohm", 1, 1e-9, 1e9},
    {"gear", "1", 1, -1e6, 1e6},
    {"efficiency_drive", "1", 1, 0, 1},
    {"efficiency_backdrive", "1", 1, 0, 10},
    {"duty_gain", "1/rad", 0, 0, 1e9},
    {"duty_damping", "s/rad", 0, 0, 1e9},
    {"duty_limit", "1", 1, 0, 1e9},
    {"supply_v", "V", 0, 0, 1e6},
    {"command_delay_s", "s", 0, 0, 10, Combine::kSum},
    {"torque_delay_s", "s", 0, 0, 10, Combine::kSum},
    {"time_constant_s", "s", 0, 0, 1e6, Combine::kSum, Needs::kActivation, "", true},
    {"second_time_constant_s", "s", 0, 0, 1e6, Combine::kSum, Needs::kActivation, "", true},
    {"dead_zone", "command or N m", 0, 0, 1e9},
    {"torque_limit_n_m", "N m", 0, 0, 1e9, Combine::kLower},
    {"power_w", "W", 0, 0, 1e12, Combine::kLower},
    {"generating_power_w", "W", 0, 0, 1e12, Combine::kLower},
    {"peak_torque_n_m", "N m", 0, 0, 1e9, Combine::kLower},
    {"rated_speed_rad_per_s", "rad/s", 0, 0, 1e9},
    {"no_load_speed_rad_per_s", "rad/s", 0, 0, 1e9},
    {"generating_factor", "1", 1, 0, 1e6},
    {"sag_fraction", "1", 0, 0, 100, Combine::kSum, Needs::kActivation},
    {"sag_time_constant_s", "s", 0.3, 0, 1e6, Combine::kSum, Needs::kNothing, "", true},
    {"droop_at_peak", "1", 0, 0, 10},
    {"droop_reference_n_m", "N m", 1, 1e-12, 1e9},
    {"droop_exponent", "1", 1, 0.1, 10},
    {"asymmetry", "1", 0, -1, 1},
    {"command_asymmetry", "1", 0, -1, 1},
    {"limit_softness", "1", 0, 0, 1},
    {"friction_slope_n_m_s_per_rad", "N m s/rad", 0, 0, 1e9},
    {"friction_load_coefficient", "1", 0, 0, 10},
    {"friction_hump_n_m", "N m", 0, 0, 1e9},
    {"friction_hump_speed_rad_per_s", "rad/s", 0.05, 0, 1e9},
}};

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
