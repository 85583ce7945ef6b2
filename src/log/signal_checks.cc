#include "src/log/signal_checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>

#include "src/core/statistics.h"

namespace gapscope {
namespace {

std::vector<double> Finite(const std::vector<double>& values) {
  std::vector<double> finite;
  finite.reserve(values.size());
  for (const double x : values) {
    if (std::isfinite(x)) finite.push_back(x);
  }
  return finite;
}

// Share of the steps that are whole multiples of `step`, to 5 % of it; steps of more than `most` counts are left out,
// since rounding in the file adds up.
struct GridFit {
  std::size_t on = 0, of = 0;
  double refined = 0;
};
GridFit FitGrid(const std::vector<double>& steps, double step, double most) {
  GridFit fit;
  double right = 0, left = 0;
  for (const double s : steps) {
    const double n = std::round(s / step);
    if (n > most) continue;
    ++fit.of;
    if (std::abs(s - n * step) > 0.05 * step || n < 1) continue;
    ++fit.on;
    right += n * s;
    left += n * n;
  }
  fit.refined = left > 0 ? right / left : step;
  return fit;
}

// Does a signal that came by `before` and `last` to `limit` and stayed there for `length` rows look cut off? At a
// smooth turning point v = a t^2 seen in counts, speed there (2 a h) times stay (2 h) is 4 counts, since a h^2 is one.
bool IsCutOff(double before, double last, double limit, std::size_t length, double step) {
  const double speed = std::abs(limit - before) / 2;
  return std::abs(limit - last) > 1.5 * step && speed * static_cast<double>(length) > 8 * step;
}

}  // namespace

Wraps FindWraps(const std::vector<double>& values, double period) {
  Wraps wraps;
  const double* previous = nullptr;
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (!std::isfinite(values[k])) continue;
    if (previous) {
      const double jump = values[k] - *previous;
      const double turns = std::round(jump / period);
      if (turns != 0) {
        if (wraps.count++ == 0) wraps.first = k;
        wraps.unsure += std::abs(jump - turns * period) > 0.25 * period;
      }
    }
    previous = &values[k];
  }
  return wraps;
}

void Unwrap(double period, std::vector<double>* values) {
  double turns = 0, previous = kNaN;
  for (double& x : *values) {
    if (!std::isfinite(x)) continue;
    if (std::isfinite(previous)) turns -= std::round((x - previous) / period);
    previous = x;
    x += turns * period;
  }
}

Wraps FindUndeclaredWraps(const std::vector<double>& values, double period) {
  const std::vector<double> finite = Finite(values);
  Wraps wraps;
  if (finite.empty()) return wraps;
  const auto [low, high] = std::minmax_element(finite.begin(), finite.end());
  const double slack = 0.02 * period;
  const bool centred = *low >= -period / 2 - slack && *high <= period / 2 + slack;
  const bool positive = *low >= -slack && *high <= period + slack;
  if ((!centred && !positive) || *high - *low < 0.9 * period) return wraps;
  const double middle = centred ? 0 : period / 2;
  const double* previous = nullptr;
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (!std::isfinite(values[k])) continue;
    if (previous && std::abs(values[k] - *previous) > 0.8 * period && (values[k] - middle) * (*previous - middle) < 0) {
      if (wraps.count++ == 0) wraps.first = k;
    }
    previous = &values[k];
  }
  return wraps;
}

Saturation FindSaturation(const std::vector<double>& values) {
  Saturation found;
  std::set<double> levels;  // as many as decide
  std::size_t finite = 0;
  found.low = kInfinity, found.high = -kInfinity;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    ++finite;
    found.low = std::min(found.low, value), found.high = std::max(found.high, value);
    if (levels.size() <= kSaturationLevels) levels.insert(value);
  }
  if (finite < 2 * kSaturationRun) return {};
  if (levels.size() <= kSaturationLevels) return found;
  std::optional<double> step;  // costs much, and most signals never stay at their limits

  for (const double limit : {found.high, found.low}) {
    std::size_t rows = 0, first = 0;
    bool cut_off = false;
    for (std::size_t k = 0; k < values.size();) {
      if (values[k] != limit) {
        ++k;
        continue;
      }
      const std::size_t begin = k;
      while (k < values.size() && values[k] == limit) ++k;
      const std::size_t length = k - begin;
      if (length < kSaturationRun) continue;
      if (rows == 0) first = begin;
      rows += length;
      if (begin >= 2 && k + 1 < values.size() && !cut_off) {
        if (!step) step = QuantisationStep(values);
        cut_off = IsCutOff(values[begin - 2], values[begin - 1], limit, length, *step) &&
                  IsCutOff(values[k + 1], values[k], limit, length, *step);
      }
    }
    if (rows == 0 || !cut_off) continue;
    if (found.count == 0 || first < found.first) found.first = first;
    found.count += rows;
    (limit == found.high ? found.at_high : found.at_low) = true;
  }
  if (static_cast<double>(found.count) > kSaturationMost * static_cast<double>(values.size())) return {};
  return found;
}

double QuantisationStep(const std::vector<double>& values) {
  std::vector<double> sorted = Finite(values);
  if (sorted.size() < 10) return 0;
  std::vector<double> steps;
  steps.reserve(sorted.size());
  for (std::size_t k = 1; k < sorted.size(); ++k) {
    if (sorted[k] != sorted[k - 1]) steps.push_back(std::abs(sorted[k] - sorted[k - 1]));
  }
  std::sort(sorted.begin(), sorted.end());
  const double range = sorted.back() - sorted.front();
  if (!(range > 0) || !std::isfinite(range) || steps.size() < 5) return 0;
  // Levels that differ by rounding in the file only are one.
  std::vector<double> distances;
  for (std::size_t k = 1; k < sorted.size(); ++k) {
    if (const double distance = sorted[k] - sorted[k - 1]; distance > 1e-6 * range) distances.push_back(distance);
  }
  if (distances.size() < 2) return 0;
  for (const double share : {0.0, 0.02, 0.1, 0.25, 0.5}) {
    const auto rank =
        distances.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(distances.size() - 1));
    std::nth_element(distances.begin(), rank, distances.end());
    const double candidate = *rank;
    const GridFit coarse = FitGrid(steps, candidate, 8);
    const GridFit fit = FitGrid(steps, coarse.refined, 20);
    // Enough small steps must be there to tell a grid from chance.
    if (fit.on >= 5 && fit.of >= steps.size() / 4 && static_cast<double>(fit.on) >= 0.9 * static_cast<double>(fit.of)) {
      return fit.refined;
    }
  }
  return 0;
}

double NoiseEstimate(const std::vector<double>& all, double step) {
  const std::vector<double> values = Finite(all);
  std::vector<double> bends;
  bends.reserve(values.size());
  for (std::size_t k = 1; k + 1 < values.size(); ++k) {
    const double bend = std::abs(values[k - 1] - 2 * values[k] + values[k + 1]);
    if (std::isfinite(bend)) bends.push_back(bend);
  }
  const double floor = step / std::sqrt(12.0);
  if (bends.empty()) return floor;
  return std::max(floor, Median(std::move(bends)) / (0.6744897501960817 * std::sqrt(6.0)));
}

}  // namespace gapscope
