// How much of an effect shows in the logs, measured in sensor floors: the change of the angles between the plant that
// made the logs and another plant, in windows of about a second that start at the true motion.
//   raw    root mean square over samples and signals of (change / floor)
//   refit  the same after the best linearised move of the other plant's own parameters, a zero offset per signal, a
//          delay, and each window's initial state: what no retuning takes away
#ifndef GAPSCOPE_TESTS_TWIN_GAP_H_
#define GAPSCOPE_TESTS_TWIN_GAP_H_

#include <array>
#include <functional>
#include <vector>

#include "tests/twin/plant.h"
#include "tests/twin/recorder.h"

namespace gapscope::twin {

// One thing a retuning may change: move(plant, step * x), x about N(0, (spread / step)^2).
struct Direction {
  std::function<void(Plant*, double)> move;
  double step, spread;
};
// The free base parameters, relative moves with the contract's spread.
std::vector<Direction> BaseDirections(Rig rig);

struct GapOptions {
  double step_s = 2.5e-4;
  double window_s = 1.0;
  double sample_s = 0.008;
};

struct Gap {
  double raw = 0, refit = 0;
  std::vector<double> moves;  // best moves along the directions
  std::vector<double> logs;   // raw, of each record alone
  bool Finite() const;
};

// The records must hold snapshots (one window apart). `refit` false leaves `refit` and `moves` empty.
Gap MeasureGap(const std::vector<Record>& records, const Plant& other, const std::array<double, 2>& floor_rad,
               const std::vector<Direction>& directions, bool refit, const GapOptions& options);

// How far each of the others, and last the records themselves, are from `plant` in windows that start at the true
// motion: less what a retuning along the directions takes up, and less what the directions `beside` take up too. Linear
// about `plant`.
struct Trace {
  double refit = 0, beside = 0;
};
std::vector<Trace> MeasureTraces(const std::vector<Record>& records, const Plant& plant,
                                 const std::vector<Plant>& others, const std::array<double, 2>& floor_rad,
                                 const std::vector<Direction>& directions, const std::vector<Direction>& beside,
                                 const GapOptions& options);

// Moves `rival` along the directions until its gap is least (damped Gauss-Newton); returns that gap.
Gap FitRival(const std::vector<Record>& records, const std::array<double, 2>& floor_rad,
             const std::vector<Direction>& directions, int iterations, const GapOptions& options, Plant* rival);

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_GAP_H_
