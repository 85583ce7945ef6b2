#include "src/core/statistics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace gapscope {
namespace {

double OfRank(std::vector<double>* values, std::size_t rank) {
  const auto at = values->begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values->begin(), at, values->end());
  return *at;
}

}  // namespace

Moments MomentsOf(std::span<const double> values) {
  double sum = 0, low = kNaN, high = kNaN, count = 0;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    low = std::fmin(low, value);
    high = std::fmax(high, value);
    sum += value, count += 1;
  }
  const double mean = sum / count;
  if (low == high) return {mean, 0};
  double squares = 0;
  for (const double value : values) {
    if (std::isfinite(value)) squares += (value - mean) * (value - mean);
  }
  return {mean, std::sqrt(squares / count)};
}

double LargestMagnitude(std::span<const double> values) {
  double largest = 0;
  for (const double value : values) {
    if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
  }
  return largest;
}

double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return kNaN;
  return OfRank(&values, static_cast<std::size_t>(std::lround(share * static_cast<double>(values.size() - 1))));
}

double Median(std::vector<double> values) {
  if (values.empty()) return kNaN;
  return OfRank(&values, values.size() / 2);
}

double StudentQuantile(double freedom) {
  if (freedom <= 1) return 12.706;
  if (freedom <= 2) return 4.303;
  if (freedom <= 3) return 3.182;
  // Cornish and Fisher's expansion about the normal quantile.
  const double n = freedom, z = kNormalQuantile, z2 = z * z;
  return z + z * (z2 + 1) / (4 * n) + z * (5 * z2 * z2 + 16 * z2 + 3) / (96 * n * n) +
         z * (3 * z2 * z2 * z2 + 19 * z2 * z2 + 17 * z2 - 15) / (384 * n * n * n);
}

double JackknifeHalf(std::span<const double> estimates) {
  const auto parts = static_cast<double>(estimates.size());
  return parts < 3 ? 0 : StudentQuantile(parts - 1) * MomentsOf(estimates).deviation * std::sqrt(parts);
}

double StudentTails(double t, std::size_t freedom) {
  // The finite sums of Abramowitz & Stegun 26.7.3 and 26.7.4.
  const double angle = std::atan(std::abs(t) / std::sqrt(static_cast<double>(freedom)));
  const double cosine = std::cos(angle), square = cosine * cosine;
  const bool odd = freedom % 2 == 1;
  double term = odd ? cosine : 1, sum = freedom == 1 ? 0 : term;
  for (std::size_t k = odd ? 3 : 2; k + 2 <= freedom; k += 2) {
    term *= square * static_cast<double>(k - 1) / static_cast<double>(k);
    sum += term;
  }
  const double within = std::sin(angle) * sum;
  return std::max(1e-15, 1 - (odd ? 2 / std::numbers::pi * (angle + within) : within));
}

}  // namespace gapscope
