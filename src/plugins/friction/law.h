// The dry-friction law of gapscope.friction: the level, in N m, that sliding meets and that holds at rest.
//
//   level = F + load (1 or backdrive) + (S - F) exp(-|w / ws|^p) + directional,   S > F only
//   load  = c |T| + c2 T^2
//
// Coulomb, Stribeck: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, "A survey of models, analysis tools and
// compensation methods for the control of machines with friction", Automatica 30(7), 1994. Load and direction of power:
// Duclusaud, Passault, Padois, Ly, "Extended Friction Models for the Physics Simulation of Servo Actuators", ICRA 2025.
#ifndef GAPSCOPE_PLUGINS_FRICTION_LAW_H_
#define GAPSCOPE_PLUGINS_FRICTION_LAW_H_

#include <algorithm>
#include <cmath>

namespace gapscope::plugins {

struct DryFriction {
  double coulomb_n_m = 0;
  double breakaway_n_m = 0;  // at rest; at or below `coulomb_n_m` there is no hump
  double stribeck_speed_rad_per_s = 0.05;
  double stribeck_exponent = 2;
  double positive_n_m = 0, negative_n_m = 0;  // added in motion of that sign
  double load_coefficient = 0;
  double load_quadratic_per_n_m = 0;
  double backdrive_factor = 1;
};

// exp(-|w / ws|^p); a speed ws of 0 is a hump at standstill only.
inline double StribeckShare(double speed, double stribeck_speed, double exponent) {
  if (speed == 0) return 1;
  if (!(stribeck_speed > 0)) return 0;
  const double ratio = std::abs(speed) / stribeck_speed;
  return std::exp(exponent == 2 ? -ratio * ratio : -std::pow(ratio, exponent));
}

// `direction` is the sign of the motion, or at rest of the motion that would begin without friction; 0 takes the mean
// of both. `load_n_m` is the torque through the gears, `drive_n_m` the motor's: against the direction it is
// back-driven.
inline double DryLevel(const DryFriction& f, double speed_rad_per_s, int direction, double load_n_m, double drive_n_m) {
  double level = f.coulomb_n_m;
  if (f.load_coefficient != 0 || f.load_quadratic_per_n_m != 0) {
    double load = f.load_coefficient * std::abs(load_n_m) + f.load_quadratic_per_n_m * load_n_m * load_n_m;
    if (drive_n_m * direction < 0) load *= f.backdrive_factor;
    level += load;
  }
  if (f.breakaway_n_m > f.coulomb_n_m) {
    level += (f.breakaway_n_m - f.coulomb_n_m) *
             StribeckShare(speed_rad_per_s, f.stribeck_speed_rad_per_s, f.stribeck_exponent);
  }
  level += direction > 0 ? f.positive_n_m : direction < 0 ? f.negative_n_m : 0.5 * (f.positive_n_m + f.negative_n_m);
  return std::max(level, 0.0);
}

}  // namespace gapscope::plugins

#endif  // GAPSCOPE_PLUGINS_FRICTION_LAW_H_
