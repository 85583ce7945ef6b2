// Small helpers of the twin's own tests: plants stripped to what a closed form knows.
#ifndef GAPSCOPE_TESTS_TWIN_PLANTS_H_
#define GAPSCOPE_TESTS_TWIN_PLANTS_H_

#include <functional>
#include <vector>

#include "tests/twin/plant.h"
#include "tests/twin/simulator.h"

namespace gapscope::twin {

inline constexpr double kStep_s = 5e-5;

// No drive torque whatever the command, no damping anywhere.
inline Plant Free(Rig rig) {
  Plant plant = NominalPlant(rig);
  Base& b = plant.base;
  b.kp_n_m_per_rad = b.kd_n_m_s_per_rad = 0;
  b.kt_n_m_per_a = b.km_v_s_per_rad = 0;
  b.torque_per_ampere_n_m = 0;
  b.damping_n_m_s_per_rad = b.second_damping_n_m_s_per_rad = 0;
  return plant;
}

// The joint as an ideal torque source: T = feedforward.
inline Plant TorqueSource() {
  Plant plant = NominalPlant(Rig::kJoint);
  plant.base.kp_n_m_per_rad = plant.base.kd_n_m_s_per_rad = 0;
  plant.base.damping_n_m_s_per_rad = 0;
  return plant;
}

inline Commands Constant(double command, double feedforward_n_m = 0) {
  Commands commands;
  commands.Add(0, command, feedforward_n_m, 0);
  return commands;
}

// Runs for `duration_s`, calling `look` after every substep.
inline void RunFor(double duration_s, const Commands& commands, Simulator* simulator,
                   const std::function<void(const Simulator&)>& look = {}) {
  const double end = simulator->time_s() + duration_s - simulator->step_s() / 2;
  while (simulator->time_s() < end) {
    simulator->Step(commands);
    if (look) look(*simulator);
  }
}

// Mean time between upward crossings of `level`.
inline double Period(double duration_s, const Commands& commands, Simulator* simulator,
                     const std::function<double(const Simulator&)>& signal, double level = 0) {
  std::vector<double> crossings;
  double last = signal(*simulator) - level;
  RunFor(duration_s, commands, simulator, [&](const Simulator& s) {
    const double now = signal(s) - level;
    if (last < 0 && now >= 0) crossings.push_back(s.time_s() - s.step_s() * now / (now - last));
    last = now;
  });
  return (crossings.back() - crossings.front()) / static_cast<double>(crossings.size() - 1);
}

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_PLANTS_H_
