#include "src/core/change_point.h"

#include <algorithm>
#include <cmath>

#include "src/core/statistics.h"

namespace gapscope {
namespace {

struct Part {
  double mean = 0, weight = 0;
};

// `between`: variance from day to day, beside what each estimate states.
Part WeightedMean(std::span<const SeriesValue> part, double between) {
  Part all;
  for (const SeriesValue& one : part) {
    const double weight = 1 / (between + one.error * one.error);
    all.weight += weight;
    all.mean += weight * (one.value - all.mean) / all.weight;
  }
  return all;
}

double SquaresAbout(std::span<const SeriesValue> part, double mean, double between) {
  double sum = 0;
  for (const SeriesValue& one : part)
    sum += (one.value - mean) * (one.value - mean) / (between + one.error * one.error);
  return sum;
}

double SquaresAboutPlainMean(std::span<const SeriesValue> part) {
  double mean = 0, sum = 0;
  for (const SeriesValue& one : part) mean += one.value / static_cast<double>(part.size());
  for (const SeriesValue& one : part) sum += (one.value - mean) * (one.value - mean);
  return sum;
}

// Of equal values the variance is rounding, not zero: a step of them is a step.
double LeastVariance(std::span<const SeriesValue> series) {
  double largest = 0;
  for (const SeriesValue& one : series) largest = std::max(largest, std::abs(one.value));
  return std::max(1e-18 * largest * largest, 1e-300);
}

// A single step at any place, its chance over all places.
ChangePoint BestStep(std::span<const SeriesValue> series) {
  ChangePoint best{.chance = 2};
  for (std::size_t first = kLeastPart; first + kLeastPart <= series.size(); ++first) {
    const ChangePoint step = StepAt(series, first);
    if (step.chance < best.chance) best = step;
  }
  best.chance *= static_cast<double>(series.size() - 2 * kLeastPart + 1);
  return best;
}

// There and back: a stretch [first, last) unlike what lies around it.
struct Stretch {
  std::size_t first = 0, last = 0;
  ChangePoint step;  // after: in the stretch; its chance is over all stretches
};

// The stretch whose plain mean stands out the most; only of that one the chance is worked out, which makes it no less.
Stretch BestStretch(std::span<const SeriesValue> series) {
  const std::size_t n = series.size();
  double mean = 0, most = -1;
  for (const SeriesValue& one : series) mean += one.value / static_cast<double>(n);
  Stretch best;
  std::size_t stretches = 0;
  for (std::size_t first = kLeastPart; first + 2 * kLeastPart <= n; ++first) {
    double sum = 0;
    for (std::size_t last = first + 1; last + kLeastPart <= n; ++last) {
      sum += series[last - 1].value - mean;
      if (last < first + kLeastPart) continue;
      ++stretches;
      const auto in = static_cast<double>(last - first);
      const double score = sum * sum / (in * (static_cast<double>(n) - in));
      if (score > most) most = score, best.first = first, best.last = last;
    }
  }
  if (stretches == 0) return {.step = {.chance = 2}};
  std::vector<SeriesValue> turned(series.begin(), series.end());
  std::rotate(turned.begin() + static_cast<std::ptrdiff_t>(best.first),
              turned.begin() + static_cast<std::ptrdiff_t>(best.last), turned.end());
  best.step = StepAt(turned, n - (best.last - best.first));
  best.step.chance *= static_cast<double>(stretches);
  return best;
}

void Search(std::span<const SeriesValue> series, std::size_t begin, double chance, std::vector<ChangePoint>* found) {
  if (series.size() < kLeastSeries) return;
  ChangePoint step = BestStep(series);
  Stretch stretch = BestStretch(series);
  // Half of what is allowed goes to either kind.
  const bool back = stretch.step.chance < step.chance;
  if (back) step = stretch.step, step.first = stretch.first;
  step.chance = std::min(1.0, 2 * step.chance);
  if (step.chance > chance) return;
  const std::size_t last = back ? stretch.last : series.size();
  Search(series.first(step.first), begin, chance, found);
  found->push_back(step);
  found->back().first += begin;
  Search(series.subspan(step.first, last - step.first), begin + step.first, chance, found);
  if (!back) return;
  std::swap(step.before, step.after);
  step.first = last;
  found->push_back(step);
  found->back().first += begin;
  Search(series.subspan(last), begin + last, chance, found);
}

}  // namespace

ChangePoint StepAt(std::span<const SeriesValue> series, std::size_t first) {
  const auto before = series.first(first), after = series.subspan(first);
  constexpr std::size_t kNormal = 1000;  // of a normal distribution, as good as
  const std::size_t freedom = series.size() > 2 ? series.size() - 2 : kNormal;
  double stated = 0;
  for (const SeriesValue& one : series) stated += one.error * one.error / static_cast<double>(series.size());
  const double seen = (SquaresAboutPlainMean(before) + SquaresAboutPlainMean(after)) / static_cast<double>(freedom);
  // A day that states a small error weighs at most twice a middling one: what days really differ by need not go with
  // what they state. (Of 30 days with as much again from day to day, 4 in 100 stable robots were called without this.)
  std::vector<double> variances;
  for (const SeriesValue& one : series) variances.push_back(one.error * one.error);
  const double between =
      freedom == kNormal ? 0 : std::max({seen - stated, seen / 2, Median(variances), LeastVariance(series)});
  const Part a = WeightedMean(before, between), b = WeightedMean(after, between);
  const double left = SquaresAbout(before, a.mean, between) + SquaresAbout(after, b.mean, between);
  // What is common to all days is in their intervals too, and makes no step: of fits to short logs days differ by a
  // fifth of what each states. Less than that is estimates that stick, at a bound say, not days that are alike.
  constexpr double kLeastShare = 0.2;
  const double least = freedom == kNormal ? 1 : kLeastShare * kLeastShare;
  const double scale = std::max(least, left / static_cast<double>(freedom));
  const double t = (b.mean - a.mean) / std::sqrt(scale * (1 / a.weight + 1 / b.weight));
  return {.first = first, .before = a.mean, .after = b.mean, .chance = StudentTails(t, freedom)};
}

std::vector<ChangePoint> FindChanges(std::span<const SeriesValue> series, double chance) {
  std::vector<ChangePoint> found;
  Search(series, 0, chance, &found);
  return found;
}

}  // namespace gapscope
