// What a measured signal is doing at one of its stamps: value and slope of a polynomial through the samples around it.
#ifndef GAPSCOPE_EXPERIMENT_LOCAL_FIT_H_
#define GAPSCOPE_EXPERIMENT_LOCAL_FIT_H_

#include <cstddef>
#include <span>

#include "src/experiment/recording.h"

namespace gapscope {

struct LocalFit {
  double value = 0, slope = 0;  // SI, SI per second
};

// Sampled of one number; a value that is not finite is none.
struct Sampled {
  std::span<const double> time_s, values;
  double resolution = 0;
};
inline Sampled SampledOf(const Recording& recording, const Recording::Measured& measured) {
  return {recording.time_s, measured.values, measured.spec.resolution};
}

// At `row`, by least squares over +-`half_width_s` (one-sided at the ends): the initial state of a
// replay. The polynomial is a parabola; of a degree up to five where there are samples on both sides and a higher power
// stands clear of their noise and counts: at 10 Hz and 20 ms a parabola's slope is 16 % too small. A slope within two
// standard errors of zero is zero, and the value then the sample itself; so is that of a first row that is followed by
// 10 ms within one count, or by so little way beside the next 40 ms that motion had only begun.
LocalFit FitLocally(const Sampled& samples, std::size_t row, double half_width_s);
inline LocalFit FitLocally(const Recording& recording, const Recording::Measured& measured, std::size_t row,
                           double half_width_s) {
  return FitLocally(SampledOf(recording, measured), row, half_width_s);
}

}  // namespace gapscope

#endif  // GAPSCOPE_EXPERIMENT_LOCAL_FIT_H_
