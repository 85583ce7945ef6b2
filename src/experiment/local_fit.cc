#include "src/experiment/local_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace gapscope {
namespace {

// A log that begins at rest: nothing leaves the first sample's count for the first 10 ms, or so much more of the way is
// made in the 40 ms after them (24 times at a constant acceleration from rest, 4 times at a constant speed) that the
// motion had only begun.
bool StartsAtRest(const Sampled& samples) {
  constexpr double kBegin_s = 0.01, kEnd_s = 0.05, kFarther = 8;
  const auto t = samples.time_s, values = samples.values;
  const auto next = [&](std::size_t k) {
    do {
      ++k;
    } while (k < t.size() && !std::isfinite(values[k]));
    return k;
  };
  std::size_t k = next(0);
  bool stays = true;
  for (int count = 1; k < t.size() && (count < 3 || t[k] - t[0] <= kBegin_s); ++count, k = next(k))
    stays = stays && std::abs(values[k] - values[0]) <= 1.01 * samples.resolution;
  if (stays) return true;
  std::size_t begin = next(0), end = begin;
  while (next(begin) < t.size() && t[begin] - t[0] < kBegin_s) begin = next(begin);
  while (next(end) < t.size() && t[end] - t[0] < kEnd_s) end = next(end);
  return kFarther * std::abs(values[begin] - values[0]) <= std::abs(values[end] - values[begin]);
}

// The samples that a fit takes: those within the half width, and at least seven where there are, so that a parabola
// does not follow single counts.
struct Reach {
  std::size_t first = 0, last = 0;
};

Reach ReachOf(const Sampled& samples, std::size_t row, double half_width_s) {
  const auto t = samples.time_s, values = samples.values;
  std::size_t first = row, last = row;
  while (first > 0 && t[row] - t[first - 1] <= half_width_s) --first;
  while (last + 1 < t.size() && t[last + 1] - t[row] <= half_width_s) ++last;
  int there = 0;
  for (std::size_t k = first; k <= last; ++k) there += std::isfinite(values[k]);
  while (there < 7 && (first > 0 || last + 1 < t.size())) {
    if (last + 1 < t.size()) there += std::isfinite(values[++last]);
    if (there < 7 && first > 0) there += std::isfinite(values[--first]);
  }
  return {first, last};
}

constexpr int kParabola = 2, kHighest = 5;
using Powers = Eigen::Matrix<double, kHighest + 1, 1>;
using Coefficients = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kHighest + 1, 1>;

// Normal equations of y = y0 + sum of c_k s^k with s = (t - t[row]) / scale, y0 the first sample.
struct Normal {
  Eigen::Matrix<double, kHighest + 1, kHighest + 1> matrix = decltype(matrix)::Zero();
  Powers right = Powers::Zero();
  double squares = 0, y0 = 0, scale = 0;
  int count = 0;
  bool both_sides = false;
};

Normal NormalOf(const Sampled& samples, std::size_t row, const Reach& reach) {
  constexpr double kBothSides = 0.75;
  const auto t = samples.time_s, values = samples.values;
  const double before = t[row] - t[reach.first], after = t[reach.last] - t[row];
  Normal normal{.scale = std::max(before, after),
                .both_sides = std::min(before, after) > kBothSides * std::max(before, after)};
  for (std::size_t k = reach.first; k <= reach.last; ++k) {
    if (!std::isfinite(values[k])) continue;
    if (normal.count++ == 0) normal.y0 = values[k];
    const double y = values[k] - normal.y0, s = normal.scale > 0 ? (t[k] - t[row]) / normal.scale : 0;
    Powers basis;
    basis[0] = 1;
    for (int power = 1; power <= kHighest; ++power) basis[power] = basis[power - 1] * s;
    normal.matrix += basis * basis.transpose();
    normal.right += basis * y;
    normal.squares += y * y;
  }
  return normal;
}

}  // namespace

LocalFit FitLocally(const Sampled& samples, std::size_t row, double half_width_s) {
  const auto values = samples.values;
  if (row == 0 && std::isfinite(values[0]) && StartsAtRest(samples)) return {values[0], 0};
  const Normal normal = NormalOf(samples, row, ReachOf(samples, row, half_width_s));
  const LocalFit rest{std::isfinite(values[row]) ? values[row] : 0, 0};
  if (normal.count < 4) return rest;
  const double quantisation = samples.resolution * samples.resolution / 12;
  // The leading blocks of one triangular factor are those of all degrees: what a power adds is its square in `parts`.
  const Eigen::LLT<decltype(normal.matrix)> whole(normal.matrix);
  const Powers parts = whole.matrixL().solve(normal.right);
  constexpr double kClear = 16;  // square of four standard errors
  // Few samples may scatter less about a high power than their resolution lets them.
  const auto noise_at = [&](int degree) {
    const double left = std::max(normal.squares - parts.head(degree + 1).squaredNorm(), 0.0);
    return std::max(left / (normal.count - degree - 1), quantisation);
  };
  const int highest = normal.both_sides ? std::clamp((normal.count - 1) / 2, kParabola, kHighest) : kParabola;
  int degree = kParabola;
  for (int d = kParabola + 1; d <= highest; ++d) {
    if (parts[d] * parts[d] > std::max(kClear * noise_at(highest), normal.count * quantisation)) degree = d;
  }
  const auto factor = whole.matrixLLT().topLeftCorner(degree + 1, degree + 1).triangularView<Eigen::Lower>();
  const Coefficients fit = factor.transpose().solve(parts.head(degree + 1));
  const double slope_variance = factor.solve(Powers::Unit(1).head(degree + 1)).squaredNorm();
  // A slope that the samples cannot tell from rest is rest: at a log's first row the fit is one-sided and weak.
  constexpr double kSignificant = 2;
  const double slope_error = std::sqrt(noise_at(degree) * slope_variance);
  if (!(std::abs(fit[1]) > kSignificant * slope_error) && std::isfinite(values[row])) return rest;
  return {normal.y0 + fit[0], fit[1] / normal.scale};
}

}  // namespace gapscope
