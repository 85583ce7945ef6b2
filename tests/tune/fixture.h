// What the tests of the tuner share: a cart on a spring whose motion has a closed form, and logs that a model made
// itself.
#ifndef GAPSCOPE_TESTS_TUNE_FIXTURE_H_
#define GAPSCOPE_TESTS_TUNE_FIXTURE_H_

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "src/tune/tune.h"

namespace gapscope::testing {

// A model and everything that must live as long as it.
struct Rig {
  Experiment experiment;
  std::shared_ptr<const Model> model;
  std::vector<double> Values(const std::map<std::string, double>& changed = {}) const;  // nominal with some changed
  int Index(const std::string& parameter) const;
};

// models/RIG with effects ("coulomb_friction@arm").
Rig LoadRig(const std::string& rig, const std::vector<std::string>& effects = {});

// models/qube with a cable on its arm, in whose scales a few mN m/rad and mN m/rad^3 are much.
Rig LoadCubicCable();

// A cart of 2 kg on a spring of 8 N/m, driven by gain * u: q'' = (gain u - 8 q - damping q') / 2, Euler at the sample
// time. Parameters: cart.gain (1.5, within [low, high]; in units, not logarithmic), cart.damping (0, [0, 4], frozen).
// With `force`, the motor's force is measured too.
Rig LoadCart(double low = -10, double high = 10, bool force = false);
inline constexpr double kCartMass_kg = 2, kCartStiffness_n_per_m = 8, kCartStep_s = 0.004;
// A link on a hinge about its y axis, in gravity, whose inertia is under `inertia:`: link.alpha ... link.t3.
Rig LoadLink();
// Three such carts side by side, by Runge-Kutta: a, b, c; the second one drags the third along where `linked`.
// Parameters: CART.gain, CART.damping, free. `speed`: that of b is measured too, and not scored.
Rig LoadThreeCarts(bool linked, bool speed = false);
// The cart's positions at the stamps of `command`, each held to the next, in closed form, without damping.
std::vector<double> CartMotion(double gain, double q0, double v0, const std::vector<double>& command);

// A log of `rig` made by its own simulator: `command(t)` on the first actuator at `period_s`, from rest at the initial
// pose; Gaussian noise and quantisation to each signal's resolution added. Signals: all positions.
Recording MakeLog(const Rig& rig, const std::vector<double>& values, const std::function<double(double)>& command,
                  double duration_s, double period_s, double noise_deviation, unsigned long seed,
                  double time_step_s = 0);

// An empty recording of `rig` with these stamps, command and measured positions of the first signal.
Recording MakeRecording(const Rig& rig, std::vector<double> command, std::vector<double> measured, double period_s);

}  // namespace gapscope::testing

#endif  // GAPSCOPE_TESTS_TUNE_FIXTURE_H_
