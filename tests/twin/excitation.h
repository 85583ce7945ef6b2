// Test signals of about unit amplitude; the generator scales them to the rig.
#ifndef GAPSCOPE_TESTS_TWIN_EXCITATION_H_
#define GAPSCOPE_TESTS_TWIN_EXCITATION_H_

#include <string_view>
#include <vector>

#include "tests/twin/random.h"

namespace gapscope::twin {

enum class Shape { kZero, kChirp, kMultisine, kSteps, kTriangle, kSquare, kRamps, kSwept, kConstant };
const char* ShapeName(Shape shape);
// False when there is no such shape.
bool ParseShape(std::string_view name, Shape* shape);

struct Excitation {
  Shape shape = Shape::kZero;
  double duration_s = 5;
  double low_hz = 0.2, high_hz = 5;              // chirp: from, to; multisine: band; triangle, square, swept: low_hz
  double envelope = 0;                           // chirp: amplitude ~ (f / high)^envelope
  double growth = 0;                             // square, triangle, swept: amplitude from 1 - growth to 1 over the log
  double phase = 0;                              // of a turn
  std::vector<double> hz, amplitude, phase_rad;  // multisine
  std::vector<double> until_s, level;            // steps, ramps

  double At(double time_s) const;
};

// Draws what the shape needs. `low_hz` and `high_hz` bound the frequencies.
Excitation MakeExcitation(Shape shape, double duration_s, double low_hz, double high_hz, Random* random);

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_EXCITATION_H_
