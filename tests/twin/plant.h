// What a twin plant is made of: the base parameters of a rig and every effect, each with its neutral value.
// Values only; src of motion is simulator.h. Nothing here comes from the diagnosing program's models.
#ifndef GAPSCOPE_TESTS_TWIN_PLANT_H_
#define GAPSCOPE_TESTS_TWIN_PLANT_H_

#include <array>
#include <limits>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

namespace gapscope::twin {

enum class Rig { kJoint, kQube, kFlexJoint, kFlexLink };
inline constexpr std::array kRigs = {Rig::kJoint, Rig::kQube, Rig::kFlexJoint, Rig::kFlexLink};
inline constexpr double kNever = std::numeric_limits<double>::infinity();
inline constexpr double kTurn = 2 * std::numbers::pi;  // rad
inline constexpr double kSpread = 0.18;                // of base parameters: inside the experiment files' bounds

// Base parameters; those that a rig does not have stay at zero (gear and efficiency at one).
struct Base {
  double kp_n_m_per_rad = 0, kd_n_m_s_per_rad = 0;                  // joint: the servo
  double resistance_ohm = 0, kt_n_m_per_a = 0, km_v_s_per_rad = 0;  // voltage drives
  double gear = 1, efficiency = 1;
  double torque_per_ampere_n_m = 0;  // flexlink
  double rotor_inertia_kg_m2 = 0, hub_inertia_kg_m2 = 0;
  double arm_mass_kg = 0, arm_length_m = 0, pendulum_mass_kg = 0, pendulum_length_m = 0;
  double inertia_kg_m2 = 0;  // first joint, except qube
  double damping_n_m_s_per_rad = 0;
  double link_inertia_kg_m2 = 0, link_stiffness_n_m_per_rad = 0;  // flexible rigs
  double second_damping_n_m_s_per_rad = 0;                        // pendulum, link, deflection
  double gravity_m_per_s2 = 9.81;
};

// One base parameter by the name of the rig's experiment file.
struct BaseParameter {
  std::string name, unit;
  double Base::* field;
  double relative_spread;  // 0: exact
};
const std::vector<BaseParameter>& BaseParameters(Rig rig);
Base NominalBase(Rig rig);
const char* RigName(Rig rig);
// False when there is no such rig.
bool ParseRig(std::string_view name, Rig* rig);

// Names of the first joint, the second joint (empty on `joint`) and their measured signals.
struct RigNames {
  std::string first, second, first_signal, second_signal, command, command_suffix;
};
const RigNames& Names(Rig rig);
inline int SignalCount(Rig rig) { return rig == Rig::kJoint ? 1 : 2; }
inline bool VoltageDriven(Rig rig) { return rig == Rig::kQube || rig == Rig::kFlexJoint; }

// The drive, from the command to the torque at the first joint.
struct Drive {
  double command_delay_s = 0, torque_delay_s = 0;
  double jitter = 0;                   // standard deviation of a command's delay over its mean
  double lag_s = 0, second_lag_s = 0;  // two poles
  double dead_zone = 0;                // N m, V or A: half width
  double torque_limit_n_m = kNever;
  double power_w = kNever;  // motoring: torque * speed <= power
  double corner = 0;        // 0: sharp limits, otherwise the exponent of the rounded corner
  double droop = 0, droop_peak_n_m = 1, droop_exponent = 1;
  double sag_ceiling = kNever, sag_depth = 0, sag_time_s = 1;  // N m, V or A
  double asymmetry = 0;
};

enum class FrictionLaw { kMaxwellSlip, kLuGre };

// Dry friction and drag of one joint: |friction| is at most
// (slide + (breakaway - slide) exp(-(v / stribeck)^2)) of the direction, plus load_coefficient |torque|.
struct Dry {
  double positive_n_m = 0, negative_n_m = 0;  // sliding friction for either direction
  double breakaway_over_slide = 1, stribeck_speed_rad_per_s = 1;
  double load_coefficient = 0;
  double drag_n_m_s2_per_rad2 = 0;
  double presliding_rad = 5e-4;  // deflection at which it slips
  FrictionLaw law = FrictionLaw::kMaxwellSlip;
  bool Any() const { return positive_n_m > 0 || negative_n_m > 0 || load_coefficient > 0; }
};

// Between motor side and load side of the first joint, and what pulls on the load side.
struct Load {
  double motor_share = 0.5;   // of the driven inertia, when split
  double gap_rad = 0;         // backlash: whole gap
  double stiffness = kNever;  // joint compliance
  double contact_hz = 300;    // backlash without compliance: how stiff the flanks are
  double transmission_damping_ratio = 0.1;
  double cable_stiffness = 0, cable_rest_rad = 0, cable_hysteresis = 0;
  double cable_cubic = 0;  // by the third power of the stretch
  double gravity_n_m = 0, gravity_rest_rad = 0;
  double bias_n_m = 0;
  double cogging_n_m = 0, cogging_periods = 12, cogging_phase_rad = 0, cogging_second = 0, cogging_second_phase_rad = 0;
  double hardening_per_rad = 0;  // link spring: K sinh(b a) / b
  bool Split() const { return gap_rad > 0 || stiffness < kNever; }
};

// Outside the list: what a diagnosis must call unknown.
struct Outside {
  double torque_n_m = 0, torque_hz = 1, torque_phase_rad = 0;              // periodic torque from outside
  double warm_up = 0, warm_up_time_s = 1;                                  // viscous friction times 1 + a exp(-t / T)
  double gain_swing = 0, gain_hz = 0.2, gain_phase_rad = 0;                // drive gain times 1 + a sin
  double resonator_share = 0, resonator_hz = 5, resonator_damping = 0.02;  // a mass on a spring on the load
  double scale_drift_per_s = 0;                                            // sensor: angle times 1 + d t
  int drift_signal = 0;
  double wheel_error_rad = 0, wheel_phase_rad = 0;  // sensor: eccentric code wheel, once a turn
  double play_rad = 0;                              // sensor: coupling with play
  int play_signal = 0;
  double clock_drift_per_s = 0;                  // stamp = t + d t^2 / 2
  int bad_stamp_bursts = 0, bad_stamp_rows = 0;  // rows lost, the rest stamped as if none were
  double hold_per_s = 0, hold_time_s = 0.05;     // the drive keeps an old command now and then
};

// One wave of a rough torque, x and v angle and speed over their deviations:
// amplitude (1 + swing sin(W t + swing_phase)) sin(angle x + speed v + phase + wander sin(W t + wander_phase)).
struct RoughTerm {
  double amplitude = 0, angle = 0, speed = 0, phase_rad = 0;
  double drift_hz = 0, swing = 0, swing_phase_rad = 0, wander_rad = 0, wander_phase_rad = 0;
};

// A smooth torque of one joint's angle and speed that no catalogue holds (rough.h): scale (waves - laws).
struct Rough {
  static constexpr int kLaws = 7;
  double scale_n_m = 0;
  double middle_rad = 0, angle_rad = 1, speed_rad_per_s = 1;  // mean and deviations of the joint's own motion
  double memory_rad = 0;  // the waves see the angle through a play this wide: their value remembers the direction
  std::vector<RoughTerm> terms;
  std::array<double, kLaws> laws{};  // what the catalogue's laws hold of the waves, taken out of them
  bool Any() const { return scale_n_m != 0; }
};

struct Plant {
  Rig rig = Rig::kJoint;
  Base base;
  Drive drive;
  std::array<Dry, 2> dry;  // first, second joint
  Load load;
  std::array<double, 2> sensor_delay_s = {0, 0};
  Outside outside;
  std::array<Rough, 2> rough;  // first, second joint
};

inline Plant NominalPlant(Rig rig) {
  Plant plant;
  plant.rig = rig;
  plant.base = NominalBase(rig);
  return plant;
}

// Inertia driven by the motor that a split divides: without pendulum and link.
double DrivenInertia(const Plant& plant);

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_PLANT_H_
