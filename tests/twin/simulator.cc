#include "tests/twin/simulator.h"

#include <algorithm>
#include <cmath>

#include "tests/twin/laws.h"
#include "tests/twin/rough.h"

namespace gapscope::twin {
namespace {

constexpr double kLongestDelay_s = 0.05;
constexpr double kLowestCeiling = 0.15;  // a sagging supply keeps this share

double Second(const Base& b) { return b.pendulum_mass_kg * b.pendulum_length_m * b.pendulum_length_m / 3; }
double Coupling(const Base& b) { return b.pendulum_mass_kg * b.arm_length_m * b.pendulum_length_m / 2; }

double SpringTorque(const Plant& p, double angle) {
  const double b = p.load.hardening_per_rad;
  return p.base.link_stiffness_n_m_per_rad * (b > 0 ? std::sinh(b * angle) / b : angle);
}

double Gain(const Outside& o, double time_s) {
  return o.gain_swing == 0 ? 1.0 : 1 + o.gain_swing * std::sin(kTurn * o.gain_hz * time_s + o.gain_phase_rad);
}

double ViscousFactor(const Outside& o, double time_s) {
  return o.warm_up == 0 ? 1.0 : 1 + o.warm_up * std::exp(-time_s / o.warm_up_time_s);
}

}  // namespace

std::size_t Acting(const Commands& commands, double time_s, std::size_t row) {
  const double now = time_s + 1e-9;
  while (row + 1 < commands.time_s.size() && commands.time_s[row + 1] + commands.delay_s[row + 1] <= now) ++row;
  return row;
}

Simulator::Simulator(const Plant& plant, double step_s) : step_s_(step_s) {
  Become(plant);
  Place(0, 0, 0, 0);
}

void Simulator::Become(const Plant& plant) {
  const bool was_split = plant_.load.Split();
  const std::array<Dry, 2> before = plant_.dry;
  plant_ = plant;
  cursor_ = 0;  // another delay: other rows act
  driven_inertia_ = DrivenInertia(plant);
  if (plant.load.Split()) {
    const double s = plant.load.motor_share;
    const double reduced = driven_inertia_ * s * (1 - s);
    const double w = kTurn * plant.load.contact_hz;
    contact_stiffness_ = plant.load.stiffness < kNever ? plant.load.stiffness : reduced * w * w;
    contact_damping_ = 2 * plant.load.transmission_damping_ratio * std::sqrt(contact_stiffness_ * reduced);
  }
  if (!was_split || !plant.load.Split()) {
    x_[kQm] = x_[kQ1];
    x_[kWm] = x_[kW1];
  }
  for (int j = 0; j < 2; ++j) {
    if (!before[j].Any()) bristles_[j].Slide(plant.dry[j], j == 0 ? x_[kW1] : x_[kW2], output_.torque_n_m);
  }
  if (plant.drive.torque_delay_s > 0 && demands_.empty()) {
    demands_.assign(static_cast<std::size_t>(kLongestDelay_s / step_s_) + 4, output_.demand_n_m);
  }
}

void Simulator::Place(double q1_rad, double w1_rad_per_s, double q2_rad, double w2_rad_per_s) {
  x_[kQ1] = x_[kQm] = q1_rad;
  x_[kW1] = x_[kWm] = w1_rad_per_s;
  x_[kQ2] = q2_rad;
  x_[kW2] = w2_rad_per_s;
  x_[kQr] = q1_rad + (plant_.rig == Rig::kFlexJoint || plant_.rig == Rig::kFlexLink ? q2_rad : 0);
  start_ = x_;
  rough_angle_ = {q1_rad, q2_rad};
}

void Simulator::Nudge(double q1_rad, double w1_rad_per_s, double q2_rad, double w2_rad_per_s) {
  x_[kQ1] += q1_rad;
  x_[kQm] += q1_rad;
  x_[kW1] += w1_rad_per_s;
  x_[kWm] += w1_rad_per_s;
  x_[kQ2] += q2_rad;
  x_[kW2] += w2_rad_per_s;
  start_ = x_;
}

double Simulator::DelayedDemand(double at_s, double newest) const {
  if (demands_.empty()) return newest;
  const double ago = std::max((at_s - clock_offset_s_) / step_s_,
                              static_cast<double>(steps_ - static_cast<long>(demands_.size()) + 2));
  const long before = std::min(static_cast<long>(std::floor(ago)), steps_);
  if (before < 0) return demands_[0];
  const double part = ago - static_cast<double>(before);
  const long size = static_cast<long>(demands_.size());
  const double low = demands_[static_cast<std::size_t>(before % size)];
  const double high = before + 1 > steps_ ? newest : demands_[static_cast<std::size_t>((before + 1) % size)];
  return low + part * (high - low);
}

Simulator::Inputs Simulator::At(const Commands& commands, double time_s, std::size_t* cursor) const {
  Inputs in{0, 0, time_s, 0};
  if (commands.time_s.empty()) return in;
  *cursor = Acting(commands, time_s, *cursor);
  in.command = commands.value[*cursor];
  in.feedforward_n_m = commands.feedforward_n_m[*cursor];
  return in;
}

DriveOutput Simulator::DriveAt(const State& x, const Inputs& in, State* rate) const {
  const Base& b = plant_.base;
  const Drive& d = plant_.drive;
  const bool split = plant_.load.Split();
  const double angle = split ? x[kQm] : x[kQ1];
  const double speed = split ? x[kWm] : x[kW1];
  const double gain = Gain(plant_.outside, in.time_s);
  DriveOutput out;

  const auto dead = [&](double u) { return BeyondDeadZone(u, d.dead_zone); };
  const auto limited = [&](double u, double limit) { return Limited(u, limit, d.corner); };
  const auto ceiling = [&](double u) {
    return d.sag_ceiling == kNever ? u
                                   : limited(u, d.sag_ceiling * std::max(kLowestCeiling, 1 - d.sag_depth * x[kSag]));
  };
  // Two poles in series; without lag both outputs follow at once.
  const auto lagged = [&](double u) {
    if (d.lag_s == 0) {
      (*rate)[kLag] = (*rate)[kSecondLag] = 0;
      return u;
    }
    (*rate)[kLag] = (u - x[kLag]) / d.lag_s;
    if (d.second_lag_s == 0) return x[kLag];
    (*rate)[kSecondLag] = (x[kLag] - x[kSecondLag]) / d.second_lag_s;
    return x[kSecondLag];
  };

  double torque = 0, load = 0;
  if (plant_.rig == Rig::kJoint) {
    out.demand_n_m = b.kp_n_m_per_rad * (in.command - angle) - b.kd_n_m_s_per_rad * speed + in.feedforward_n_m;
    const double request = d.torque_delay_s > 0 ? in.delayed_demand_n_m : out.demand_n_m;
    out.effort = dead(lagged(request));
    torque = ceiling(out.effort);
    load = torque;
  } else if (plant_.rig == Rig::kFlexLink) {
    out.effort = dead(lagged(in.command));
    out.current_a = load = ceiling(out.effort);
    torque = b.torque_per_ampere_n_m * out.current_a;
  } else {
    // Winding: L i' = V - R i - km N w with L = lag * R; the second pole filters the voltage.
    out.effort = dead(in.command);
    double voltage = ceiling(out.effort);
    if (d.second_lag_s > 0) {
      (*rate)[kSecondLag] = (voltage - x[kSecondLag]) / d.second_lag_s;
      voltage = x[kSecondLag];
    }
    const double settled = (voltage - b.km_v_s_per_rad * b.gear * speed) / b.resistance_ohm;
    out.current_a = d.lag_s > 0 ? x[kLag] : settled;
    if (d.lag_s > 0) (*rate)[kLag] = (settled - x[kLag]) / d.lag_s;
    torque = b.efficiency * b.gear * b.kt_n_m_per_a * out.current_a;
    load = b.resistance_ohm * out.current_a;
  }
  torque = limited(torque, d.torque_limit_n_m);
  if (d.power_w < kNever && torque * speed > 0) torque = limited(torque, d.power_w / std::abs(speed));
  out.estimate_n_m = torque;
  out.torque_n_m = ByDirection(gain * Drooped(torque, d), d);
  if (d.sag_ceiling < kNever) (*rate)[kSag] = (std::abs(load) / d.sag_ceiling - x[kSag]) / d.sag_time_s;
  return out;
}

double Simulator::Transmission(const State& x) const {
  const double twist = x[kQm] - x[kQ1];
  const double side = twist >= 0 ? 1.0 : -1.0;
  const double depth = std::abs(twist) - plant_.load.gap_rad / 2;
  if (plant_.load.gap_rad > 0 && depth <= 0) return 0;
  const double torque = contact_stiffness_ * depth + contact_damping_ * side * (x[kWm] - x[kW1]);
  return side * (plant_.load.gap_rad > 0 ? std::max(torque, 0.0) : torque);
}

double Simulator::LoadTorque(const State& x, double time_s) const {
  const Outside& o = plant_.outside;
  double torque = Pull(plant_.load, cable_, x[kQ1], x[kQ1] - start_[kQ1]);
  if (o.torque_n_m != 0) torque += o.torque_n_m * std::sin(kTurn * o.torque_hz * time_s + o.torque_phase_rad);
  if (plant_.rough[0].Any()) torque += RoughOf(0, x, time_s);
  return torque;
}

double Simulator::RoughOf(int joint, const State& x, double time_s) const {
  const auto j = static_cast<std::size_t>(joint);
  const Rough& rough = plant_.rough[j];
  const double angle = x[joint == 0 ? kQ1 : kQ2], speed = x[joint == 0 ? kW1 : kW2];
  return RoughTorque(rough, rough_angle_[j], {angle, speed}, session_s_ + time_s);
}

Simulator::State Simulator::Derivative(const State& x, const Inputs& in) const {
  const Base& b = plant_.base;
  const Outside& o = plant_.outside;
  const bool split = plant_.load.Split();
  State rate{};
  const DriveOutput drive = DriveAt(x, in, &rate);

  // Motor side: drive, viscous and dry friction, drag.
  const double qm = split ? x[kQm] : x[kQ1], wm = split ? x[kWm] : x[kW1];
  const double start = split ? start_[kQm] : start_[kQ1];
  const double motor_inertia = driven_inertia_ * (split ? plant_.load.motor_share : 1.0);
  const double motor = drive.torque_n_m - b.damping_n_m_s_per_rad * ViscousFactor(o, in.time_s) * wm -
                       Drag(plant_.dry[0], wm) -
                       bristles_[0].Torque(plant_.dry[0], qm - start, wm, drive.torque_n_m, motor_inertia);
  double first = LoadTorque(x, in.time_s);
  double load_inertia = driven_inertia_;
  if (split) {
    const double through = Transmission(x);
    rate[kQm] = x[kWm];
    rate[kWm] = (motor - through) / motor_inertia;
    first += through;
    load_inertia -= motor_inertia;
  } else {
    first += motor;
  }

  double hidden = 0;  // torque of the hidden resonator on the load's absolute angle
  const bool flexible = plant_.rig == Rig::kFlexJoint || plant_.rig == Rig::kFlexLink;
  if (o.resonator_share > 0) {
    const double inertia = o.resonator_share * (flexible ? b.link_inertia_kg_m2 : driven_inertia_);
    const double w = kTurn * o.resonator_hz;
    const double angle = x[kQ1] + (flexible ? x[kQ2] : 0), speed = x[kW1] + (flexible ? x[kW2] : 0);
    hidden = inertia * (w * w * (x[kQr] - angle) + 2 * o.resonator_damping * w * (x[kWr] - speed));
    rate[kQr] = x[kWr];
    rate[kWr] = -hidden / inertia;
  }

  rate[kQ1] = x[kW1];
  first += hidden;
  if (plant_.rig == Rig::kJoint) {
    rate[kW1] = first / load_inertia;
    return rate;
  }
  const double inertia2 = plant_.rig == Rig::kQube ? Second(b) : b.link_inertia_kg_m2;
  double second = -b.second_damping_n_m_s_per_rad * x[kW2] - Drag(plant_.dry[1], x[kW2]) -
                  bristles_[1].Torque(plant_.dry[1], x[kQ2] - start_[kQ2], x[kW2], 0, inertia2);
  if (plant_.rough[1].Any()) second += RoughOf(1, x, in.time_s);
  double m11, m12;
  const double m22 = inertia2;
  if (plant_.rig == Rig::kQube) {
    const double s = std::sin(x[kQ2]), c = std::cos(x[kQ2]), couple = Coupling(b);
    m11 = load_inertia + b.pendulum_mass_kg * b.arm_length_m * b.arm_length_m + inertia2 * s * s;
    m12 = couple * c;
    first += -2 * inertia2 * s * c * x[kW1] * x[kW2] + couple * s * x[kW2] * x[kW2];
    second +=
        inertia2 * s * c * x[kW1] * x[kW1] - b.pendulum_mass_kg * b.gravity_m_per_s2 * b.pendulum_length_m / 2 * s;
  } else {
    m11 = load_inertia + inertia2;
    m12 = inertia2;
    second += hidden - SpringTorque(plant_, x[kQ2]);
  }
  const double determinant = m11 * m22 - m12 * m12;
  rate[kQ2] = x[kW2];
  rate[kW1] = (m22 * first - m12 * second) / determinant;
  rate[kW2] = (m11 * second - m12 * first) / determinant;
  return rate;
}

void Simulator::Step(const Commands& commands) {
  const double t = time_s(), h = step_s_;
  start_ = x_;
  State unused{};
  Inputs in = At(commands, t, &cursor_);
  // The servo's demand now goes into its history before any delayed one is read.
  const bool late = plant_.drive.torque_delay_s > 0;
  const auto delayed = [&](Inputs* at, const State& x) {
    const double newest = DriveAt(x, *at, &unused).demand_n_m;
    at->delayed_demand_n_m = DelayedDemand(at->time_s - plant_.drive.torque_delay_s, newest);
  };
  if (late) {
    if (steps_ == 0) demands_.assign(demands_.size(), DriveAt(x_, in, &unused).demand_n_m);
    demands_[static_cast<std::size_t>(steps_) % demands_.size()] = DriveAt(x_, in, &unused).demand_n_m;
    delayed(&in, x_);
  }

  const auto stage = [&](const State& rate, double part) {
    State x;
    for (int i = 0; i < kStates; ++i) x[i] = x_[i] + part * h * rate[i];
    return x;
  };
  const State k1 = Derivative(x_, in);
  const auto middle_and_end = [&](double part) {
    // Until just before that time: a command that acts from the end of the step on is no part of it.
    Inputs at = At(commands, t + part * h - kJust_s, &cursor_);
    if (late) delayed(&at, x_);
    return at;
  };
  const Inputs middle = middle_and_end(0.5);
  const State k2 = Derivative(stage(k1, 0.5), middle);
  const State k3 = Derivative(stage(k2, 0.5), middle);
  const Inputs end = middle_and_end(1.0);
  const State k4 = Derivative(stage(k3, 1.0), end);
  for (int i = 0; i < kStates; ++i) x_[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);

  const bool split = plant_.load.Split();
  const int q = split ? kQm : kQ1, w = split ? kWm : kW1;
  bristles_[0].Commit(plant_.dry[0], x_[q] - start_[q], x_[w], output_.torque_n_m);
  bristles_[1].Commit(plant_.dry[1], x_[kQ2] - start_[kQ2], x_[kW2], 0);
  if (plant_.load.cable_stiffness > 0) cable_.Commit(plant_.load, x_[kQ1] - start_[kQ1]);
  for (std::size_t j = 0; j < 2; ++j) {
    const double angle = x_[j == 0 ? kQ1 : kQ2];
    rough_angle_[j] = Remembered(plant_.rough[j], rough_angle_[j], angle);
  }
  start_ = x_;
  ++steps_;
  if (!split) {
    x_[kQm] = x_[kQ1];
    x_[kWm] = x_[kW1];
  }
  output_ = DriveAt(x_, end, &unused);
  // Poles that are not there follow at once, so that another plant can take over here.
  const double followed = VoltageDriven(plant_.rig)      ? output_.current_a
                          : plant_.rig == Rig::kFlexLink ? end.command
                                                         : output_.demand_n_m;
  if (plant_.drive.lag_s == 0) x_[kLag] = followed;
  if (plant_.drive.second_lag_s == 0) x_[kSecondLag] = VoltageDriven(plant_.rig) ? end.command : x_[kLag];
}

double Simulator::Energy() const {
  const Base& b = plant_.base;
  const double w1 = x_[kW1], w2 = x_[kW2];
  double energy = 0;
  double load_inertia = driven_inertia_;
  if (plant_.load.Split()) {
    const double motor = driven_inertia_ * plant_.load.motor_share;
    load_inertia -= motor;
    energy += motor * x_[kWm] * x_[kWm] / 2;
    const double depth = std::max(std::abs(x_[kQm] - x_[kQ1]) - plant_.load.gap_rad / 2, 0.0);
    energy += contact_stiffness_ * depth * depth / 2;
  }
  energy += load_inertia * w1 * w1 / 2;
  if (plant_.rig == Rig::kQube) {
    // A thin rod, integrated over its length: velocity of the point at distance s from the hinge.
    const double s = std::sin(x_[kQ2]), c = std::cos(x_[kQ2]);
    const double m = b.pendulum_mass_kg, length = b.pendulum_length_m, arm = b.arm_length_m;
    energy +=
        m / 2 * (arm * arm * w1 * w1 + arm * w1 * c * w2 * length + length * length / 3 * (w2 * w2 + s * s * w1 * w1));
    energy -= m * b.gravity_m_per_s2 * length / 2 * c;
  } else if (plant_.rig != Rig::kJoint) {
    energy += b.link_inertia_kg_m2 * (w1 + w2) * (w1 + w2) / 2;
    const double hard = plant_.load.hardening_per_rad;
    energy += b.link_stiffness_n_m_per_rad *
              (hard > 0 ? (std::cosh(hard * x_[kQ2]) - 1) / (hard * hard) : x_[kQ2] * x_[kQ2] / 2);
  }
  return energy;
}

}  // namespace gapscope::twin
