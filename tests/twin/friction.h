// Dry friction with bristles: a joint that sticks deflects a little before it slips.
//
//   Maxwell slip (Iwan, generalised by Al-Bender et al. 2005): parallel springs k_i, each slipping at its share a_i of
//   the friction s(v);   force = sum k_i z_i,   z_i follows the joint, |k_i z_i| <= a_i s.
//   LuGre (Canudas de Wit et al. 1995):   dz/dt = v - k |v| z / s(v),   force = k z + c dz/dt.
//
// Both are integrated over the distance travelled, not over time: the springs' clamp and LuGre's exponential are then
// exact for any speed, and a Runge-Kutta stage evaluates the force at its own distance from the start of the step.
#ifndef GAPSCOPE_TESTS_TWIN_FRICTION_H_
#define GAPSCOPE_TESTS_TWIN_FRICTION_H_

#include <array>

#include "tests/twin/plant.h"

namespace gapscope::twin {

class Bristles {
 public:
  static constexpr int kElements = 4;

  // Friction torque, opposing motion, `distance_rad` after the last Commit, at speed `speed` and transmitted torque
  // `load_n_m`. `inertia` sets the damping c of the sticking joint (a quarter to half critical).
  double Torque(const Dry& dry, double distance_rad, double speed, double load_n_m, double inertia) const;
  // Ends a step that moved the joint by `distance_rad`.
  void Commit(const Dry& dry, double distance_rad, double speed, double load_n_m);
  // As after sliding long in the direction of `speed`.
  void Slide(const Dry& dry, double speed, double load_n_m);

 private:
  std::array<double, kElements> deflection_rad_{};
};

// s(v) for the direction of `direction`.
double SlipTorque(const Dry& dry, double direction, double speed, double load_n_m);

// A spring with a little hysteresis: the elastic part of a cable and one Maxwell element beside it.
class CableHysteresis {
 public:
  double Torque(const Load& load, double distance_rad) const;
  void Commit(const Load& load, double distance_rad);

 private:
  static double Next(double deflection, double distance);
  double deflection_rad_ = 0;
};

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_FRICTION_H_
