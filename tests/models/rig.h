// What the tests of the shipped rigs share: loading an MJCF, driving it by a held command, and an integrator of their
// own.
#ifndef GAPSCOPE_TESTS_MODELS_RIG_H_
#define GAPSCOPE_TESTS_MODELS_RIG_H_

#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "src/core/mujoco_handles.h"
#include "tests/models/rig_facts.h"

namespace gapscope::testing {

// The path of models/RIG/RIG.xml.
std::string RigPath(const std::string& rig);

// Whether the plugin library has the motor plugin that the hobby servos use.
bool HasMotorPlugin();

// A rig's MJCF, compiled. A hobby servo's plugin elements are replaced by `native_actuator` when that is not empty: the
// mechanism can then be checked without the plugin. Fails the test and returns null on an error or a warning.
ModelPtr LoadRig(const std::string& rig, const std::string& native_actuator = "");

int JointDof(const mjModel& m, const char* joint);
int Actuator(const mjModel& m, const char* actuator);

// One motion: qpos and qvel after each of `steps` steps; `command(k)` is written to all actuators before step k.
struct Motion {
  std::vector<std::vector<double>> q, v;
};
Motion Drive(const mjModel& m, const std::vector<double>& q0, int steps,
             const std::function<std::vector<double>(int)>& command);

// A chirp from `f0_hz` to `f1_hz` in `duration_s`, and a square wave on top: rich in frequencies and in steps.
double ChirpAndSteps(double t_s, double amplitude, double f0_hz, double f1_hz, double duration_s);

// x' = f(x) over `duration_s` by the classical fourth-order rule in steps of `h_s`: not MuJoCo's code.
template <std::size_t N, class F>
std::array<double, N> Integrate(std::array<double, N> x, double duration_s, double h_s, F&& f) {
  const int steps = static_cast<int>(std::lround(duration_s / h_s));
  const double h = duration_s / steps;
  auto shifted = [](const std::array<double, N>& a, double scale, const std::array<double, N>& b) {
    std::array<double, N> c;
    for (std::size_t i = 0; i < N; ++i) c[i] = a[i] + scale * b[i];
    return c;
  };
  for (int s = 0; s < steps; ++s) {
    const auto k1 = f(x), k2 = f(shifted(x, h / 2, k1)), k3 = f(shifted(x, h / 2, k2)), k4 = f(shifted(x, h, k3));
    for (std::size_t i = 0; i < N; ++i) x[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
  }
  return x;
}

// Largest difference between MuJoCo's positions and those of x' = f(x, u), x = (q..., v...), from rest at `q0`, where u
// is command(k) held over step k.
template <std::size_t N, class F>
double LargestDifference(const mjModel& m, const Motion& motion, const std::vector<double>& q0, double h_s, F&& f,
                         const std::function<std::vector<double>(int)>& command) {
  std::array<double, N> x{};
  for (std::size_t i = 0; i < N / 2; ++i) x[i] = q0[i];
  double largest = 0;
  for (std::size_t k = 0; k < motion.q.size(); ++k) {
    const std::vector<double> u = command(static_cast<int>(k));
    x = Integrate<N>(x, m.opt.timestep, h_s, [&](const std::array<double, N>& y) { return f(y, u); });
    for (std::size_t i = 0; i < N / 2; ++i) largest = std::fmax(largest, std::abs(x[i] - motion.q[k][i]));
  }
  return largest;
}

// Continuous A (2nv x 2nv) and B (2nv x nu), row-major, of x = (q, v) at (q0, 0, u = 0) by central differences of
// mj_forward.
struct Linear {
  std::vector<double> a, b;
};
Linear Linearise(const mjModel& m, const std::vector<double>& q0);

}  // namespace gapscope::testing

#endif  // GAPSCOPE_TESTS_MODELS_RIG_H_
