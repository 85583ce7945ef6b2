// Small statistics that several folders need: no value, medians and quantiles, Student's t.
#ifndef GAPSCOPE_CORE_STATISTICS_H_
#define GAPSCOPE_CORE_STATISTICS_H_

#include <limits>
#include <vector>

namespace gapscope {

// No value: what was not measured, or cannot be said.
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The value of nearest rank `share` (0 the least, 1 the greatest) of finite values; NaN of none. O(n), on a copy.
double Quantile(std::vector<double> values, double share);

// The middle value, of an even number the upper of the two; NaN of none.
double Median(std::vector<double> values);

// 97.5 % quantile of Student's t with `freedom` degrees of freedom (Abramowitz & Stegun 26.7.5 with three terms; up to
// 3 the value of the next whole number).
double StudentQuantile(double freedom);

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_STATISTICS_H_
