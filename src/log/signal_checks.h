// What a sampled signal shows of the sensor or drive it came from: wraps, saturation, counts, noise. Pure functions;
// NaN in `values` are skipped.
#ifndef GAPSCOPE_LOG_SIGNAL_CHECKS_H_
#define GAPSCOPE_LOG_SIGNAL_CHECKS_H_

#include <cstddef>
#include <vector>

namespace gapscope {

// Jumps between neighbours that are nearer to a whole number of periods than to none.
struct Wraps {
  std::size_t count = 0, first = 0;
  std::size_t unsure = 0;  // of these, the ones that leave more than a quarter of a period unexplained
};
Wraps FindWraps(const std::vector<double>& values, double period);

// Adds whole periods so that no step is longer than half a period.
void Unwrap(double period, std::vector<double>* values);

// Does the signal look like an angle that wraps, given no period: values within [-P/2, P/2] or [0, P], and jumps by
// about P between the two ends? Counts those jumps.
Wraps FindUndeclaredWraps(const std::vector<double>& values, double period);

// Rows in runs of kSaturationRun or more at exactly the largest (or smallest) value, for a signal that has more than
// kSaturationLevels levels. At least one of the runs must be entered and left faster than a smooth
// turning point would be, and the rows must not be more than kSaturationMost of all: that is a pattern of set-points.
inline constexpr std::size_t kSaturationRun = 5;
inline constexpr std::size_t kSaturationLevels = 10;
inline constexpr double kSaturationMost = 0.75;
struct Saturation {
  std::size_t count = 0, first = 0;
  double low = 0, high = 0;  // the smallest and the largest value
  bool at_low = false, at_high = false;
};
Saturation FindSaturation(const std::vector<double>& values);

// The size of one count: the smallest recurring distance between levels of which at least 90 % of the steps between
// neighbours are whole multiples (to 5 %). 0: none, or finer than a millionth of the range.
double QuantisationStep(const std::vector<double>& values);

// Standard deviation of white noise on a smooth signal, from the median of |x[k-1] - 2 x[k] + x[k+1]| (which is
// 0.6745 sqrt(6) sigma for Gaussian noise); no less than a count / sqrt(12) for a signal with counts of `step`.
double NoiseEstimate(const std::vector<double>& values, double step);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_SIGNAL_CHECKS_H_
