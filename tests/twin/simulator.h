// Motion of a twin plant: Runge-Kutta of fourth order on fixed substeps over positions, speeds and the drive's states;
// friction and cable hysteresis over the distance travelled (friction.h), delays from exact histories.
//
// Equations (q1 first joint, q2 second joint relative to the first, l half the pendulum's length, J its inertia about
// its end):
//   joint     I w1' = T
//   qube      (I + m L^2 + J sin^2 q2) w1' + m L l cos q2 w2' + J sin 2q2 w1 w2 - m L l sin q2 w2^2 = T
//             m L l cos q2 w1' + J w2' - J sin q2 cos q2 w1^2 + m g l sin q2 = S
//   flexible  (I + I_L) w1' + I_L w2' = T,   I_L (w1' + w2') + K sinh(b q2) / b = S
// T: drive torque, viscous and dry friction, drag, cable, gravity, bias, cogging, roughness; S: viscous and dry
// friction, drag, roughness (rough.h; of both joints on the load side). Split (backlash, compliance): share s of I on
// the motor side with drive, viscous, dry friction and drag, the rest on the load side with the others, and between
// them a spring and damper outside the gap (one-sided, never pulling).
#ifndef GAPSCOPE_TESTS_TWIN_SIMULATOR_H_
#define GAPSCOPE_TESTS_TWIN_SIMULATOR_H_

#include <array>
#include <vector>

#include "tests/twin/friction.h"
#include "tests/twin/plant.h"

namespace gapscope::twin {

inline constexpr double kJust_s = 1e-8;  // before a jump of the commands

// Commands in the order of their sending; each acts from its time plus its delay until the next one acts.
struct Commands {
  std::vector<double> time_s, value, feedforward_n_m, delay_s;
  void Add(double at_s, double command, double feedforward, double late_s) {
    time_s.push_back(at_s);
    value.push_back(command);
    feedforward_n_m.push_back(feedforward);
    delay_s.push_back(late_s);
  }
};

// The row that acts at a time, `row` being one that acted before.
std::size_t Acting(const Commands& commands, double time_s, std::size_t row);

struct DriveOutput {
  double torque_n_m = 0;    // at the first joint
  double estimate_n_m = 0;  // what the drive believes: before droop and direction gain
  double current_a = 0;     // winding current of a voltage drive, actual current of a current drive
  double demand_n_m = 0;    // joint: what the servo computes now, before its delay
  double effort = 0;        // what the supply's ceiling is compared with: V, A or N m
};

class Simulator {
 public:
  enum Index { kQ1, kW1, kQm, kWm, kQ2, kW2, kLag, kSecondLag, kSag, kQr, kWr, kStates };
  using State = std::array<double, kStates>;

  Simulator(const Plant& plant, double step_s);

  // Takes another plant's parameters from here on; states that the old plant did not have start consistent with the
  // motion (drive settled, bristles as after sliding).
  void Become(const Plant& plant);
  void Place(double q1_rad, double w1_rad_per_s, double q2_rad, double w2_rad_per_s);
  // Adds to the motion (both sides of the first joint alike).
  void Nudge(double q1_rad, double w1_rad_per_s, double q2_rad, double w2_rad_per_s);

  // One substep. `commands` may grow between calls but never change in the past.
  void Step(const Commands& commands);

  double time_s() const { return clock_offset_s_ + static_cast<double>(steps_) * step_s_; }
  // From here on the clock shows another time (a log's stamps may be wrong).
  void SetTime(double time_s) { clock_offset_s_ = time_s - static_cast<double>(steps_) * step_s_; }
  // Seconds from the session's begin to the log's: only what drifts from log to log sees them.
  void SetSession(double begin_s) { session_s_ = begin_s; }
  double step_s() const { return step_s_; }
  double q1() const { return x_[kQ1]; }
  double w1() const { return x_[kW1]; }
  double q2() const { return x_[kQ2]; }
  double w2() const { return x_[kW2]; }
  double motor_rad() const { return plant_.load.Split() ? x_[kQm] : x_[kQ1]; }
  const DriveOutput& drive() const { return output_; }
  // Kinetic and potential energy of the mechanism, without servo, cable, gravity offset.
  double Energy() const;

 private:
  struct Inputs {
    double command, feedforward_n_m, time_s, delayed_demand_n_m;
  };
  State Derivative(const State& x, const Inputs& in) const;
  DriveOutput DriveAt(const State& x, const Inputs& in, State* rate) const;
  double DelayedDemand(double at_s, double newest) const;
  double Transmission(const State& x) const;
  double LoadTorque(const State& x, double time_s) const;
  double RoughOf(int joint, const State& x, double time_s) const;
  Inputs At(const Commands& commands, double time_s, std::size_t* cursor) const;

  Plant plant_;
  double step_s_;
  double clock_offset_s_ = 0, session_s_ = 0;
  long steps_ = 0;
  State x_{};
  State start_{};  // at the beginning of the step: distances count from here
  std::array<Bristles, 2> bristles_;
  CableHysteresis cable_;
  std::array<double, 2> rough_angle_{};  // what a rough torque with a memory sees
  DriveOutput output_;
  std::size_t cursor_ = 0;
  std::vector<double> demands_;  // joint: demand at the beginning of each past step, a ring
  double driven_inertia_, contact_stiffness_ = 0, contact_damping_ = 0;
};

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_SIMULATOR_H_
