#include "src/report/robot_changes.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "src/core/change_point.h"
#include "src/core/statistics.h"

namespace gapscope {
namespace {

struct Series {
  std::vector<SeriesValue> estimates;
  std::vector<std::size_t> units;  // of each estimate

  void Add(std::size_t unit, SeriesValue estimate) {
    if (!std::isfinite(estimate.value)) return;
    if (!std::isfinite(estimate.error)) estimate.error = 0;
    estimates.push_back(estimate);
    units.push_back(unit);
  }
  bool Varies() const {
    return estimates.size() >= kLeastSeries &&
           std::any_of(estimates.begin(), estimates.end(),
                       [&](const SeriesValue& one) { return one.value != estimates.front().value; });
  }
};

// A probability is not surer than one case in a hundred: a day's answer is taken for no more than that.
SeriesValue OfProbability(double probability) {
  const double p = std::clamp(probability, 0.01, 0.99);
  return {.value = probability, .error = std::sqrt(p * (1 - p))};
}

std::map<std::string, Series> SeriesOf(std::span<const UnitResult> units) {
  constexpr double kIntervalWidth = 2 * kNormalQuantile;  // of a 95 % interval, in standard errors
  std::map<std::string, Series> all;
  for (std::size_t i = 0; i < units.size(); ++i) {
    const UnitResult& unit = units[i];
    if (unit.state != "done") continue;
    all["gap"].Add(i, {.value = unit.gap});
    all["nominal error"].Add(i, {.value = unit.nominal});
    for (const auto& size : unit.sizes)
      all[size.name].Add(i, {.value = size.value, .error = (size.high - size.low) / kIntervalWidth});
    for (const auto& said : unit.statements) {
      if (said.answer != "unseen") all[said.name].Add(i, OfProbability(said.probability));
    }
  }
  return all;
}

}  // namespace

std::vector<RobotChange> ChangesOf(std::span<const UnitResult> units) {
  std::map<std::string, Series> all = SeriesOf(units);
  std::erase_if(all, [](const auto& named) { return !named.second.Varies(); });
  // Half is kept for errors that are not quite normal: with days whose intervals differ in width by a factor of two and
  // more, up to 1.9 in 100 stable robots would be called at the whole of it.
  const double count = 2 * static_cast<double>(all.size());
  std::vector<RobotChange> changes;
  for (const auto& [name, series] : all) {
    for (const ChangePoint& found : FindChanges(series.estimates, kFalseChange / count))
      changes.push_back(
          {name, series.units[found.first], found.before, found.after, std::min(1.0, count * found.chance)});
  }
  std::stable_sort(changes.begin(), changes.end(), [](const auto& a, const auto& b) { return a.chance < b.chance; });
  return changes;
}

}  // namespace gapscope
