#include "src/compare/score.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "src/compare/spectrum.h"
#include "src/core/result.h"
#include "src/core/statistics.h"

namespace gapscope {
namespace {

constexpr double kLongestLag_s = 0.25;
constexpr double kFlat = 1e-9;  // correlation that varies less than this has no peak
constexpr std::size_t kFewestRowsForLag = 8;
constexpr double kGapSteps = 3;
constexpr std::size_t kMostPointsPerRow = 4;  // resampling: a gap may not multiply the work

// The rows that count.
struct Rows {
  std::vector<double> time_s, measured, predicted;
};

Rows UsedRows(std::span<const double> time_s, std::span<const double> measured, std::span<const double> predicted) {
  Rows rows;
  rows.time_s.reserve(time_s.size());
  rows.measured.reserve(time_s.size());
  rows.predicted.reserve(time_s.size());
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    if (!std::isfinite(measured[i]) || std::isnan(predicted[i])) continue;
    rows.time_s.push_back(time_s[i]);
    rows.measured.push_back(measured[i]);
    rows.predicted.push_back(predicted[i]);
  }
  return rows;
}

double Mean(std::span<const double> values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

bool Constant(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(), [&](double value) { return value == values.front(); });
}

double Pearson(std::span<const double> a, std::span<const double> b) {
  if (a.size() < 3 || Constant(a) || Constant(b)) return kNaN;
  const double mean_a = Mean(a), mean_b = Mean(b);
  double aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    aa += (a[i] - mean_a) * (a[i] - mean_a);
    bb += (b[i] - mean_b) * (b[i] - mean_b);
    ab += (a[i] - mean_a) * (b[i] - mean_b);
  }
  const double r = ab / std::sqrt(aa * bb);
  return std::isfinite(r) ? std::clamp(r, -1.0, 1.0) : kNaN;
}

// A signal on a uniform axis.
struct Points {
  std::vector<double> values;  // less their mean; zero where weight is zero
  std::vector<double> weight;  // 1, or 0 in a gap; empty: 1 throughout
};

// `values` at `count` points `step_s` apart from the first stamp, linear between rows. `gaps`: where rows lie far apart
// the points between them are left out.
Points Resample(std::span<const double> time_s, std::span<const double> values, double step_s, std::size_t count,
                bool gaps) {
  Points points{.values = std::vector<double>(count), .weight = std::vector<double>(gaps ? count : 0, 1.0)};
  std::size_t row = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double t = time_s.front() + static_cast<double>(i) * step_s;
    while (row + 2 < time_s.size() && time_s[row + 1] <= t) ++row;
    const double length_s = time_s[row + 1] - time_s[row];
    const double part = std::clamp((t - time_s[row]) / length_s, 0.0, 1.0);
    points.values[i] = values[row] + part * (values[row + 1] - values[row]);
    if (gaps && length_s > kGapSteps * step_s) points.weight[i] = 0;
  }
  double sum = 0, weight = 0;
  for (std::size_t i = 0; i < count; ++i) {
    sum += (gaps ? points.weight[i] : 1) * points.values[i];
    weight += gaps ? points.weight[i] : 1;
  }
  for (std::size_t i = 0; i < count; ++i) {
    points.values[i] = (gaps ? points.weight[i] : 1) * (points.values[i] - sum / std::max(1.0, weight));
  }
  return points;
}

std::vector<double> Squares(std::vector<double> values) {
  for (double& value : values) value *= value;
  return values;
}

// For each lag, sums over the pairs of points that overlap.
struct OverlapSums {
  std::vector<double> count, m, p, mm, pp;
};

// Without gaps the overlap is a stretch of each signal: differences of running sums.
OverlapSums WholeOverlap(const std::vector<double>& measured, const std::vector<double>& predicted,
                         std::size_t max_lag) {
  const std::size_t n = measured.size(), lags = 2 * max_lag + 1;
  const auto stretch_sums = [&](const std::vector<double>& values, bool is_measured) {
    std::vector<double> running(n + 1), result(lags);
    for (std::size_t i = 0; i < n; ++i) running[i + 1] = running[i] + values[i];
    for (std::size_t j = 0; j < lags; ++j) {
      const std::size_t cut = j > max_lag ? j - max_lag : max_lag - j;
      const bool from_start = (j < max_lag) == is_measured;
      result[j] = from_start ? running[n - cut] : running[n] - running[cut];
    }
    return result;
  };
  OverlapSums sums;
  for (std::size_t j = 0; j < lags; ++j) {
    sums.count.push_back(static_cast<double>(n - (j > max_lag ? j - max_lag : max_lag - j)));
  }
  sums.m = stretch_sums(measured, true);
  sums.p = stretch_sums(predicted, false);
  sums.mm = stretch_sums(Squares(measured), true);
  sums.pp = stretch_sums(Squares(predicted), false);
  return sums;
}

// Pearson's coefficient of measured[i + l] with predicted[i] over the overlap, for l = -max_lag..max_lag.
std::vector<double> CorrelationByLag(const Points& measured, const Points& predicted, std::size_t max_lag) {
  std::vector<double> result = CrossCorrelation(measured.values, predicted.values, max_lag);
  OverlapSums sums;
  if (measured.weight.empty()) {
    sums = WholeOverlap(measured.values, predicted.values, max_lag);
  } else {
    sums.count = CrossCorrelation(measured.weight, predicted.weight, max_lag);
    sums.m = CrossCorrelation(measured.values, predicted.weight, max_lag);
    sums.p = CrossCorrelation(measured.weight, predicted.values, max_lag);
    sums.mm = CrossCorrelation(Squares(measured.values), predicted.weight, max_lag);
    sums.pp = CrossCorrelation(measured.weight, Squares(predicted.values), max_lag);
  }
  for (std::size_t j = 0; j < result.size(); ++j) {
    const double count = sums.count[j];
    const double mm = sums.mm[j] - sums.m[j] * sums.m[j] / count, pp = sums.pp[j] - sums.p[j] * sums.p[j] / count;
    const bool enough = count > static_cast<double>(kFewestRowsForLag) - 0.5 && mm > 0 && pp > 0;
    result[j] = enough ? (result[j] - sums.m[j] * sums.p[j] / count) / std::sqrt(mm * pp) : kNaN;
  }
  return result;
}

double BestLag(const Rows& rows) {
  const std::size_t n = rows.time_s.size();
  if (n < kFewestRowsForLag || Constant(rows.measured) || Constant(rows.predicted)) return kNaN;
  const double duration_s = rows.time_s.back() - rows.time_s.front();
  const double most_points = static_cast<double>(kMostPointsPerRow * n);
  const double step_s = std::max(MedianStep(rows.time_s), duration_s / most_points);
  const auto count = static_cast<std::size_t>(duration_s / step_s + 1e-6) + 1;
  const auto max_lag = static_cast<std::size_t>(std::min(kLongestLag_s, duration_s / 4) / step_s + 1e-6);
  if (count < kFewestRowsForLag || max_lag < 1) return kNaN;

  const bool gaps = std::adjacent_find(rows.time_s.begin(), rows.time_s.end(), [&](double from, double to) {
                      return to - from > kGapSteps * step_s;
                    }) != rows.time_s.end();
  const std::vector<double> by_lag =
      CorrelationByLag(Resample(rows.time_s, rows.measured, step_s, count, gaps),
                       Resample(rows.time_s, rows.predicted, step_s, count, gaps), max_lag);
  // The greatest coefficient, the shorter lag when equal.
  double best = kNaN, least = kNaN;
  std::size_t peak = max_lag;
  for (std::size_t distance = 0; distance <= max_lag; ++distance) {
    for (const std::size_t j : {max_lag - distance, max_lag + distance}) {
      least = std::fmin(least, by_lag[j]);
      if (by_lag[j] > best || (std::isnan(best) && !std::isnan(by_lag[j]))) {
        best = by_lag[j];
        peak = j;
      }
    }
  }
  if (!(best - least > kFlat)) return kNaN;
  double lag = static_cast<double>(peak) - static_cast<double>(max_lag);
  if (peak > 0 && peak + 1 < by_lag.size()) {
    const double bend = 2 * by_lag[peak] - by_lag[peak - 1] - by_lag[peak + 1];
    if (bend > 0) lag += std::clamp((by_lag[peak + 1] - by_lag[peak - 1]) / (2 * bend), -0.5, 0.5);
  }
  return lag * step_s;
}

}  // namespace

SignalScore ScoreSignal(std::string signal, std::span<const double> time_s, std::span<const double> measured,
                        std::span<const double> predicted, double resolution) {
  GS_CHECK(time_s.size() == measured.size() && time_s.size() == predicted.size() && resolution >= 0);
  GS_CHECK(std::all_of(time_s.begin(), time_s.end(), [](double t) { return std::isfinite(t); }));
  GS_CHECK(std::adjacent_find(time_s.begin(), time_s.end(), std::greater_equal<>()) == time_s.end());
  SignalScore score{.signal = std::move(signal),
                    .rmse = kNaN,
                    .mae = kNaN,
                    .nrmse = kNaN,
                    .max = kNaN,
                    .lag_s = kNaN,
                    .correlation = kNaN,
                    .samples = 0};
  const Rows rows = UsedRows(time_s, measured, predicted);
  score.samples = rows.time_s.size();
  if (score.samples == 0) return score;

  double squares = 0, magnitudes = 0, greatest = 0;
  for (std::size_t i = 0; i < score.samples; ++i) {
    const double error = std::abs(rows.measured[i] - rows.predicted[i]);
    squares += error * error;
    magnitudes += error;
    greatest = std::max(greatest, error);
  }
  const double count = static_cast<double>(score.samples);
  score.rmse = std::sqrt(squares / count);
  score.mae = magnitudes / count;
  score.max = greatest;
  const double scale = std::max(MomentsOf(measured).deviation, resolution);
  score.nrmse = scale > 0 ? score.rmse / scale : kNaN;
  if (std::isfinite(squares)) {
    score.correlation = Pearson(rows.measured, rows.predicted);
    score.lag_s = BestLag(rows);
  }
  return score;
}

double CombinedError(std::span<const SignalScore> scores) {
  if (scores.empty()) return kNaN;
  double squares = 0;
  for (const SignalScore& score : scores) squares += score.nrmse * score.nrmse;
  return std::sqrt(squares / static_cast<double>(scores.size()));
}

}  // namespace gapscope
