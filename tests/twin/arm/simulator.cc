#include "tests/twin/arm/simulator.h"

#include <cmath>

#include "tests/twin/laws.h"
#include "tests/twin/rough.h"

namespace gapscope::twin {

ArmSimulator::ArmSimulator(const ArmPlant& plant, double step_s) : step_s_(step_s) {
  const JointVector none = JointVector::Zero(plant.count());
  x_ = {none, none, none, none};
  torque_ = estimate_ = none;
  Become(plant);
  Place(none, none);
}

void ArmSimulator::Become(const ArmPlant& plant) {
  const ArmPlant before = plant_;
  plant_ = plant;
  mechanism_ = MechanismOf(plant);
  inertia_ = MassMatrix(mechanism_, JointVector::Zero(plant.count())).diagonal();
  rows_ = {};  // another delay: other rows act
  for (int j = 0; j < plant.count(); ++j) {
    if (before.joints.empty() || !before.joints[j].dry.Any()) {
      bristles_[j].Slide(plant.joints[j].dry, x_.w[j], torque_[j]);
    }
  }
}

void ArmSimulator::Place(const JointVector& q_rad, const JointVector& w_rad_per_s) {
  x_.q = q_rad;
  x_.w = w_rad_per_s;
  start_ = x_;
  rough_angle_ = q_rad;
}

void ArmSimulator::Nudge(int joint, double q_rad, double w_rad_per_s) {
  x_.q[joint] += q_rad;
  x_.w[joint] += w_rad_per_s;
  start_ = x_;
}

ArmSimulator::State ArmSimulator::Moved(const State& x, double h, const State& rate) {
  return {x.q + h * rate.q, x.w + h * rate.w, x.lag + h * rate.lag, x.second + h * rate.second};
}

ArmSimulator::DriveTorque ArmSimulator::DriveAt(int joint, const State& x, double target, State* rate) const {
  const ArmBase& b = plant_.joints[joint].base;
  const Drive& d = plant_.joints[joint].drive;
  DriveTorque out{};
  out.demand = b.kp_n_m_per_rad * (target - x.q[joint]) - b.kd_n_m_s_per_rad * x.w[joint];
  double followed = out.demand;
  if (d.lag_s > 0) {
    rate->lag[joint] = (out.demand - x.lag[joint]) / d.lag_s;
    followed = x.lag[joint];
    if (d.second_lag_s > 0) {
      rate->second[joint] = (x.lag[joint] - x.second[joint]) / d.second_lag_s;
      followed = x.second[joint];
    }
  }
  out.estimate = Limited(BeyondDeadZone(followed, d.dead_zone), d.torque_limit_n_m, d.corner);
  out.torque = ByDirection(Drooped(out.estimate, d), d);
  return out;
}

ArmSimulator::State ArmSimulator::Derivative(const State& x, const JointVector& target, double time_s) const {
  const int n = plant_.count();
  const JointVector none = JointVector::Zero(n);
  State rate = {x.w, none, none, none};
  JointVector torque(n);
  for (int j = 0; j < n; ++j) {
    const ArmJoint& joint = plant_.joints[j];
    const double q = x.q[j], w = x.w[j], distance = q - start_.q[j];
    const double drive = DriveAt(j, x, target[j], &rate).torque;
    torque[j] = drive - joint.base.damping_n_m_s_per_rad * w - Drag(joint.dry, w) -
                bristles_[j].Torque(joint.dry, distance, w, drive, inertia_[j]) +
                Pull(joint.load, cables_[j], q, distance);
    if (joint.rough.Any()) torque[j] += RoughTorque(joint.rough, rough_angle_[j], {q, w}, session_s_ + time_s);
  }
  rate.w = ForwardDynamics(mechanism_, x.q, x.w, torque);
  return rate;
}

JointVector ArmSimulator::TargetsAt(const ArmCommands& commands, double time_s) {
  JointVector target(plant_.count());
  for (int j = 0; j < plant_.count(); ++j) {
    rows_[j] = Acting(commands[j], time_s, rows_[j]);
    target[j] = commands[j].value[rows_[j]];
  }
  return target;
}

void ArmSimulator::Step(const ArmCommands& commands) {
  const double t = time_s(), h = step_s_;
  start_ = x_;
  // Until just before a time: a command that acts from the end of the step on is no part of it.
  const JointVector first = TargetsAt(commands, t), middle = TargetsAt(commands, t + h / 2 - kJust_s);
  const JointVector end = TargetsAt(commands, t + h - kJust_s);
  const State k1 = Derivative(x_, first, t);
  const State k2 = Derivative(Moved(x_, h / 2, k1), middle, t + h / 2);
  const State k3 = Derivative(Moved(x_, h / 2, k2), middle, t + h / 2);
  const State k4 = Derivative(Moved(x_, h, k3), end, t + h);
  const auto mean = [&](JointVector State::* part) {
    return JointVector((k1.*part + 2 * k2.*part + 2 * k3.*part + k4.*part) / 6);
  };
  x_ = Moved(x_, h, {mean(&State::q), mean(&State::w), mean(&State::lag), mean(&State::second)});
  Commit(end);
}

void ArmSimulator::Commit(const JointVector& target) {
  State unused = x_;
  for (int j = 0; j < plant_.count(); ++j) {
    const ArmJoint& joint = plant_.joints[j];
    const double distance = x_.q[j] - start_.q[j];
    bristles_[j].Commit(joint.dry, distance, x_.w[j], torque_[j]);
    if (joint.load.cable_stiffness > 0) cables_[j].Commit(joint.load, distance);
    rough_angle_[j] = Remembered(joint.rough, rough_angle_[j], x_.q[j]);
    const DriveTorque drive = DriveAt(j, x_, target[j], &unused);
    torque_[j] = drive.torque;
    estimate_[j] = drive.estimate;
    // Poles that are not there follow at once, so that another plant can take over here.
    if (joint.drive.lag_s == 0) x_.lag[j] = drive.demand;
    if (joint.drive.second_lag_s == 0) x_.second[j] = x_.lag[j];
  }
  start_ = x_;
  ++steps_;
}

}  // namespace gapscope::twin
