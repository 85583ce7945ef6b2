// Laws of one drive and one joint that every twin plant uses, whatever moves behind them.
#ifndef GAPSCOPE_TESTS_TWIN_LAWS_H_
#define GAPSCOPE_TESTS_TWIN_LAWS_H_

#include <algorithm>
#include <cmath>

#include "tests/twin/friction.h"
#include "tests/twin/plant.h"

namespace gapscope::twin {

// A request less the half width of its dead zone.
inline double BeyondDeadZone(double request, double half_width) {
  return half_width == 0 ? request : std::copysign(std::max(std::abs(request) - half_width, 0.0), request);
}

// Clamped, or with a corner rounded by an exponent.
inline double Limited(double u, double limit, double corner) {
  if (limit == kNever) return u;
  if (corner == 0) return std::clamp(u, -limit, limit);
  return u / std::pow(1 + std::pow(std::abs(u / std::max(limit, 1e-9)), corner), 1 / corner);
}

// Less torque per ampere at high current.
inline double Drooped(double torque_n_m, const Drive& d) {
  if (d.droop <= 0) return torque_n_m;
  return torque_n_m *
         (1 - d.droop * std::pow(std::min(std::abs(torque_n_m) / d.droop_peak_n_m, 1.0), d.droop_exponent));
}

// The drive's gain by the sign of its torque.
inline double ByDirection(double torque_n_m, const Drive& d) {
  return torque_n_m * (1 + d.asymmetry * std::copysign(1.0, torque_n_m));
}

inline double Drag(const Dry& dry, double speed_rad_per_s) {
  return dry.drag_n_m_s2_per_rad2 * speed_rad_per_s * std::abs(speed_rad_per_s);
}

// Bias, cable, gravity and cogging at a joint's angle, `distance_rad` after the cable's last Commit.
inline double Pull(const Load& load, const CableHysteresis& cable, double q, double distance_rad) {
  double torque = load.bias_n_m;
  if (load.cable_stiffness > 0) {
    torque -= load.cable_stiffness * (q - load.cable_rest_rad) + cable.Torque(load, distance_rad);
  }
  if (load.cable_cubic != 0) torque -= load.cable_cubic * std::pow(q - load.cable_rest_rad, 3);
  if (load.gravity_n_m != 0) torque -= load.gravity_n_m * std::sin(q - load.gravity_rest_rad);
  if (load.cogging_n_m != 0) {
    const double phase = load.cogging_periods * q;
    torque += load.cogging_n_m * (std::sin(phase + load.cogging_phase_rad) +
                                  load.cogging_second * std::sin(2 * phase + load.cogging_second_phase_rad));
  }
  return torque;
}

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_LAWS_H_
