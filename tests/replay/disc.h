// A disc on a hinge and its exact motion: J w' = u - b w with commands held between irregular stamps.
#ifndef GAPSCOPE_TESTS_REPLAY_DISC_H_
#define GAPSCOPE_TESTS_REPLAY_DISC_H_

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "tests/model/synthetic.h"

namespace gapscope::testing {

inline constexpr double kInertia = 0.02, kDamping = 0.05;
// RK4 at 1 ms: (h b / J)^5 / 120 a step.
inline constexpr double kIntegration = 1e-10;

inline std::string Mjcf(const std::string& joint = "damping=\"0.05\"",
                        const std::string& actuators = "<motor name=\"motor\" joint=\"hinge\"/>") {
  return "<mujoco><compiler angle=\"radian\"/><option timestep=\"0.001\" integrator=\"RK4\" gravity=\"0 0 0\"><flag "
         "contact=\"disable\"/></option><worldbody><body name=\"disc\"><joint name=\"hinge\" axis=\"0 0 1\" " +
         joint +
         "/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"0.015 0.015 0.02\"/></body></worldbody><actuator>" +
         actuators + "</actuator></mujoco>";
}
inline constexpr const char* kYaml = R"(commands:
  - {actuator: motor, column: u, unit: N m}
measured:
  - {signal: q, column: q, joint: hinge, unit: rad, offset: q.offset}
  - {signal: w, column: w, kind: velocity, joint: hinge}
parameters:
  q.offset: {unit: rad, nominal: 0, bounds: [-1, 1]}
)";

struct State {
  double q = 0, w = 0;
};
// Exactly `t` later under a constant torque.
inline State Held(State s, double u, double t) {
  const double rate = kDamping / kInertia, end = u / kDamping, decay = std::exp(-rate * t);
  return {s.q + end * t + (s.w - end) * (1 - decay) / rate, end + (s.w - end) * decay};
}

// Stamps of 0.3 to 9 ms and a command that jumps at each.
inline Recording Irregular(const Experiment& experiment, int rows) {
  Recording recording = MakeRecording(experiment, rows, 0.002, [](int, double) { return 0.0; });
  std::mt19937 random(5);
  double t = 0;
  for (std::size_t k = 0; k < recording.rows(); ++k) {
    recording.time_s[k] = t;
    t += 0.0003 + 0.0087 * static_cast<double>(random() % 1000) / 1000;
    for (auto& command : recording.commands) command.values[k] = static_cast<double>(random() % 2001) / 1000 - 1;
  }
  return recording;
}

// The exact motion, the command being late by `delay_s`; `earlier`: what was commanded before the log's start.
inline std::vector<State> Exact(const Recording& r, double delay_s = 0, double earlier = 0) {
  std::vector<State> states = {{}};
  State s;
  const auto& u = r.commands[0].values;
  for (std::size_t k = 0; k + 1 < r.rows(); ++k) {
    double t = r.time_s[k];
    while (t < r.time_s[k + 1]) {
      if (t + 1e-13 < r.time_s[0] + delay_s) {
        const double until = std::min(r.time_s[0] + delay_s, r.time_s[k + 1]);
        s = Held(s, earlier, until - t);
        t = until;
        continue;
      }
      // What acts at t: the last command sent at or before t - delay; until when.
      std::size_t held = 0;
      while (held + 1 < r.rows() && r.time_s[held + 1] + delay_s <= t + 1e-13) ++held;
      const double until =
          held + 1 < r.rows() ? std::min(r.time_s[held + 1] + delay_s, r.time_s[k + 1]) : r.time_s[k + 1];
      s = Held(s, u[held], until - t);
      t = until;
    }
    states.push_back(s);
  }
  return states;
}

inline double WorstAngle(const std::vector<double>& q, const std::vector<State>& exact) {
  double worst = 0;
  for (std::size_t k = 0; k < q.size(); ++k) worst = std::max(worst, std::abs(q[k] - exact[k].q));
  return worst;
}

class SimulatorTest : public ::testing::Test {
 protected:
  SimulatorTest() : experiment_(MakeExperiment(scratch_, Mjcf(), kYaml)), model_(MakeModel(experiment_)) {}
  Scratch scratch_;
  Experiment experiment_;
  std::shared_ptr<const Model> model_;
};

}  // namespace gapscope::testing

#endif  // GAPSCOPE_TESTS_REPLAY_DISC_H_
