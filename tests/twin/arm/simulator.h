// Motion of a twin arm: Runge-Kutta of fourth order on fixed substeps over angles, speeds and the drives' poles;
// friction and cable hysteresis over the distance travelled (friction.h).
//
//   M(q) w' + C(q, w) + G(q) = drive - damping w - dry friction - drag + pull + roughness
//   drive of a joint: target late, servo kp (target - q) - kd w, two poles, dead zone, limits (the estimate is taken
//   here), droop, gain by direction
#ifndef GAPSCOPE_TESTS_TWIN_ARM_SIMULATOR_H_
#define GAPSCOPE_TESTS_TWIN_ARM_SIMULATOR_H_

#include <array>
#include <vector>

#include "tests/twin/arm/arm.h"
#include "tests/twin/arm/dynamics.h"
#include "tests/twin/friction.h"
#include "tests/twin/simulator.h"

namespace gapscope::twin {

// The targets of each joint.
using ArmCommands = std::vector<Commands>;

class ArmSimulator {
 public:
  ArmSimulator(const ArmPlant& plant, double step_s);

  // Takes another plant's parameters from here on, as Simulator::Become.
  void Become(const ArmPlant& plant);
  void Place(const JointVector& q_rad, const JointVector& w_rad_per_s);
  // Adds to one joint's motion.
  void Nudge(int joint, double q_rad, double w_rad_per_s);

  // One substep. `commands` may grow between calls but never change in the past.
  void Step(const ArmCommands& commands);

  double time_s() const { return begin_s_ + static_cast<double>(steps_) * step_s_; }
  void SetTime(double time_s) { begin_s_ = time_s - static_cast<double>(steps_) * step_s_; }
  // Seconds from the session's begin to the log's: only what drifts from log to log sees them.
  void SetSession(double begin_s) { session_s_ = begin_s; }
  double step_s() const { return step_s_; }
  const ArmPlant& plant() const { return plant_; }
  const JointVector& q() const { return x_.q; }
  const JointVector& w() const { return x_.w; }
  // At the joints; and what the drives believe.
  const JointVector& torque_n_m() const { return torque_; }
  const JointVector& estimate_n_m() const { return estimate_; }
  double Energy() const { return twin::Energy(mechanism_, x_.q, x_.w); }

 private:
  struct State {
    JointVector q, w, lag, second;
  };
  struct DriveTorque {
    double demand, estimate, torque;
  };
  static State Moved(const State& x, double h, const State& rate);
  DriveTorque DriveAt(int joint, const State& x, double target, State* rate) const;
  State Derivative(const State& x, const JointVector& target, double time_s) const;
  JointVector TargetsAt(const ArmCommands& commands, double time_s);
  void Commit(const JointVector& target);

  ArmPlant plant_;
  Mechanism mechanism_;
  double step_s_, begin_s_ = 0, session_s_ = 0;
  long steps_ = 0;
  State x_, start_;  // now; and at the beginning of the step: distances count from here
  JointVector torque_, estimate_, inertia_, rough_angle_;
  std::array<Bristles, kMostJoints> bristles_;
  std::array<CableHysteresis, kMostJoints> cables_;
  std::array<std::size_t, kMostJoints> rows_{};  // of the commands, acting
};

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_ARM_SIMULATOR_H_
