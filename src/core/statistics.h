// Small statistics that several folders need: no value, mean and deviation, medians and quantiles, Student's t.
#ifndef GAPSCOPE_CORE_STATISTICS_H_
#define GAPSCOPE_CORE_STATISTICS_H_

#include <limits>
#include <span>
#include <vector>

namespace gapscope {

// No value: what was not measured, or cannot be said.
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Mean and standard deviation (over n, not n - 1) of the values that are finite; NaN when none is. Of values that are
// all the same the deviation is exactly zero.
struct Moments {
  double mean = 0, deviation = 0;
};
Moments MomentsOf(std::span<const double> values);

// Of the values that are finite; 0 of none.
double LargestMagnitude(std::span<const double> values);

// The value of nearest rank `share` (0 the least, 1 the greatest) of finite values; NaN of none. O(n), on a copy.
double Quantile(std::vector<double> values, double share);

// The middle value, of an even number the upper of the two; NaN of none.
double Median(std::vector<double> values);

inline constexpr double kNormalQuantile = 1.959964;  // 95 % of a normal distribution lie within so many deviations

// 97.5 % quantile of Student's t with `freedom` degrees of freedom (Abramowitz & Stegun 26.7.5 with three terms; up to
// 3 the value of the next whole number).
double StudentQuantile(double freedom);

// Half of the 95 % interval of a number, by estimates of it each of which lacks another part of the data: what leaving
// out shows needs no residuals that are smooth in the number (the delete-a-group jackknife: Wolter, Introduction to
// Variance Estimation, 2007, section 4.2; its variance is that of an estimate that lacks a part). 0 of fewer than
// three.
double JackknifeHalf(std::span<const double> estimates);

// That Student's t with `freedom` degrees of freedom, 1 or more, lies further from zero than `t` on either side.
double StudentTails(double t, std::size_t freedom);

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_STATISTICS_H_
