#include "src/draft/samples.h"

#include <algorithm>
#include <cmath>

#include "src/core/statistics.h"

namespace gapscope {
namespace {

constexpr std::size_t kMostRows = 4096;
constexpr double kSlopeHalfWidth_s = 0.01, kLongestLag_s = 0.3;
constexpr int kLags = 24;  // of each sign

std::size_t RowsWithin(const Timeline& timeline, double seconds) {
  return std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(seconds / timeline.median_step_s)));
}

// Sums of powers of the time from the middle, and of them times the values.
struct Sums {
  double t0 = 0, t1 = 0, t2 = 0, t3 = 0, t4 = 0, y0 = 0, y1 = 0, y2 = 0;
};

}  // namespace

FittedLine LineThrough(const std::vector<double>& x, const std::vector<double>& y) {
  double mx = 0, my = 0, n = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (std::isfinite(x[i]) && std::isfinite(y[i])) mx += x[i], my += y[i], n += 1;
  }
  if (n < 8) return {};
  mx /= n, my /= n;
  double xx = 0, yy = 0, xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isfinite(x[i]) || !std::isfinite(y[i])) continue;
    const double dx = x[i] - mx, dy = y[i] - my;
    xx += dx * dx, yy += dy * dy, xy += dx * dy;
  }
  if (!(xx > 0 && yy > 0)) return {};
  const double slope = xy / xx;
  return {.slope = slope, .intercept = my - slope * mx, .correlation = xy / std::sqrt(xx * yy)};
}

Samples::Samples(const Log& log, const Timeline& timeline) : log_(log), timeline_(timeline) {
  const std::size_t count = timeline.time_s.size(), sampled = std::min(count, kMostRows);
  for (std::size_t k = 0; k < sampled; ++k) rows_.push_back(k * count / sampled);
  const std::size_t near = RowsWithin(timeline, kSlopeHalfWidth_s);
  for (std::size_t c = 0; c < log.columns.size(); ++c) {
    std::vector<double> values = Shifted(c, 0), slopes;
    for (const std::size_t row : rows_) {
      const std::size_t a = row - std::min(row, near), b = std::min(row + near, count - 1);
      slopes.push_back(b > a ? (At(c, b) - At(c, a)) / (timeline.time_s[b] - timeline.time_s[a]) : kNaN);
    }
    double low = kInfinity, high = -kInfinity;
    bool whole = true;
    for (const double v : log.columns[c].values) {
      if (!std::isfinite(v)) continue;
      low = std::min(low, v), high = std::max(high, v);
      whole = whole && v == std::floor(v);
    }
    if (!(high >= low)) low = high = 0;
    values_.push_back(std::move(values));
    slopes_.push_back(std::move(slopes));
    lowest_.push_back(low), highest_.push_back(high), whole_.push_back(whole);
  }
}

double Samples::At(std::size_t column, std::size_t row) const {
  return log_.columns[column].values[timeline_.rows[row]];
}

std::vector<double> Samples::Shifted(std::size_t column, long rows) const {
  std::vector<double> values;
  values.reserve(rows_.size());
  const auto count = static_cast<long>(timeline_.time_s.size());
  for (const std::size_t row : rows_) {
    const long at = static_cast<long>(row) + rows;
    values.push_back(at >= 0 && at < count ? At(column, static_cast<std::size_t>(at)) : kNaN);
  }
  return values;
}

std::vector<int> Samples::Lags(double longest_s, double step_s) const {
  const auto longest = static_cast<int>(longest_s / timeline_.median_step_s);
  const auto step = static_cast<int>(RowsWithin(timeline_, step_s));
  std::vector<int> lags;
  for (int late = 0; late <= longest; late += step) lags.push_back(late);
  return lags;
}

Following Samples::Follow(std::size_t leader, std::size_t follower) const {
  Following best;
  const auto most = static_cast<long>(RowsWithin(timeline_, kLongestLag_s));
  long before = -most - 1;
  for (int i = -kLags; i <= kLags; ++i) {
    const long rows = std::lround(static_cast<double>(most) * i / kLags);
    if (rows == before) continue;
    before = rows;
    const FittedLine line = LineThrough(Shifted(leader, -rows), values_[follower]);
    if (std::abs(line.correlation) <= std::abs(best.correlation)) continue;
    best = {.correlation = line.correlation,
            .slope = line.slope,
            .lag_s = static_cast<double>(rows) * timeline_.median_step_s};
  }
  return best;
}

std::vector<Samples::Motion> Samples::MotionOf(std::size_t column, double half_width_s) const {
  const std::size_t near = std::max<std::size_t>(2, RowsWithin(timeline_, half_width_s));
  const std::size_t count = timeline_.time_s.size();
  std::vector<Motion> motion;
  for (const std::size_t row : rows_) {
    Sums s;
    double lowest = kInfinity, highest = -kInfinity;
    const bool inside = row >= near && row + near < count;
    for (std::size_t i = row - std::min(row, near); inside && i <= row + near; ++i) {
      const double t = timeline_.time_s[i] - timeline_.time_s[row], y = At(column, i);
      s.t0 += 1, s.t1 += t, s.t2 += t * t, s.t3 += t * t * t, s.t4 += t * t * t * t;
      s.y0 += y, s.y1 += t * y, s.y2 += t * t * y;
      lowest = std::min(lowest, y), highest = std::max(highest, y);
    }
    // y = a + b t + c t^2 by Cramer's rule.
    const auto det = [](double a, double b, double c, double d, double e, double f, double g, double h, double i) {
      return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
    };
    const double d = det(s.t0, s.t1, s.t2, s.t1, s.t2, s.t3, s.t2, s.t3, s.t4);
    motion.push_back({.value = det(s.y0, s.t1, s.t2, s.y1, s.t2, s.t3, s.y2, s.t3, s.t4) / d,
                      .slope = det(s.t0, s.y0, s.t2, s.t1, s.y1, s.t3, s.t2, s.y2, s.t4) / d,
                      .curvature = 2 * det(s.t0, s.t1, s.y0, s.t1, s.t2, s.y1, s.t2, s.t3, s.y2) / d,
                      .lowest = lowest,
                      .highest = highest});
  }
  return motion;
}

}  // namespace gapscope
