#include "src/compare/conditions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

#include "src/compare/bootstrap.h"
#include "src/compare/condition_bins.h"
#include "src/compare/noise.h"
#include "src/compare/spectrum.h"
#include "src/core/collect.h"
#include "src/core/result.h"
#include "src/core/statistics.h"

namespace gapscope {
namespace {

constexpr std::size_t kFewestRows = 3;
constexpr std::size_t kFewestRowsForInterval = 20;
constexpr std::size_t kFewestRowsForFrequency = 16;
constexpr double kBandwidthPart = 0.95;
constexpr std::array<double, 4> kBandLimits = {0.25, 0.5, 1, 2};  // of the signal's bandwidth
constexpr double kBlockCorrelationTimes = 6;
constexpr double kLow = 0.05, kHigh = 0.95;
constexpr double kNormal95 = 1.6449;  // the normal distribution's 95th percentile

// One condition and its share of the time. Its squared error stands in a column of its own, by cell (bootstrap.h).
struct Condition {
  ConditionFamily family;
  std::string name;
  double share_of_time;
};

struct Conditions {
  std::vector<Condition> list;
  std::vector<std::vector<double>> columns;  // squared error, list.size() columns of CellCount(rows)
};

// measured - predicted in units of the greatest error, so that no square overflows; NaN for rows left out.
std::vector<double> ScaledErrors(const ConditionInput& input, const std::vector<char>& used) {
  std::vector<double> errors(used.size(), kNaN);
  double greatest = 0;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    errors[i] = input.measured[i] / 2 - input.predicted[i] / 2;
    greatest = std::max(greatest, std::abs(errors[i]));
  }
  if (greatest > 0) {
    for (double& error : errors) error /= greatest;
  } else {
    errors.clear();
  }
  return errors;
}

void AddPartition(const Partition& partition, const std::vector<double>& errors, Conditions* conditions) {
  std::vector<std::size_t> rows(partition.names.size());
  std::size_t all = 0;
  for (const int bin : partition.bin) {
    if (bin < 0) continue;
    ++rows[static_cast<std::size_t>(bin)];
    ++all;
  }
  if (std::count_if(rows.begin(), rows.end(), [](std::size_t count) { return count > 0; }) < 2) return;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (rows[k] == 0) continue;
    const double share = static_cast<double>(rows[k]) / static_cast<double>(all);
    conditions->list.push_back({.family = partition.family, .name = partition.names[k], .share_of_time = share});
    std::vector<double>& column = conditions->columns.emplace_back(CellCount(errors.size()));
    for (std::size_t i = 0; i < errors.size(); ++i) {
      if (partition.bin[i] == static_cast<int>(k)) column[i / RowsPerCell(errors.size())] += errors[i] * errors[i];
    }
  }
}

// The frequency below which 95 % of the signal's mean square lies, mean removed; NaN for a constant signal.
double Bandwidth(const BandSplitter& signal, double* total) {
  *total = 0;
  for (std::size_t k = 1; k < signal.bins(); ++k) *total += signal.power()[k];
  double sum = 0;
  for (std::size_t k = 1; k < signal.bins(); ++k) {
    sum += signal.power()[k];
    if (sum >= kBandwidthPart * *total && sum > 0) return static_cast<double>(k) * signal.bin_hz();
  }
  return kNaN;
}

void AddFrequencies(const ConditionInput& input, const std::vector<char>& used, const std::vector<double>& errors,
                    Conditions* conditions) {
  std::vector<double> measured(used.size(), kNaN);
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i]) measured[i] = input.measured[i];
  }
  const double step_s = MedianStep(input.time_s);
  const BandSplitter signal(FillGaps(measured), step_s), error(FillGaps(errors), step_s);
  double signal_power = 0;
  const double bandwidth_hz = Bandwidth(signal, &signal_power);
  if (!std::isfinite(bandwidth_hz)) return;

  // The mean, then bands between limits; the last one ends at the Nyquist frequency.
  const double nyquist_hz = 0.5 / step_s;
  std::vector<double> limits_hz = {0};
  for (const double part : kBandLimits) {
    const double limit = RoundToTwoDigits(part * bandwidth_hz);
    if (limit > limits_hz.back() && limit < nyquist_hz) limits_hz.push_back(limit);
  }
  limits_hz.push_back(nyquist_hz);
  std::size_t first = 0;
  for (std::size_t band = 0; band < limits_hz.size(); ++band) {
    std::size_t last = error.bins();
    if (band == 0) {
      last = 1;
    } else if (band + 1 < limits_hz.size()) {
      last = static_cast<std::size_t>(limits_hz[band] / error.bin_hz() * (1 + 1e-12)) + 1;  // limit included
    }
    if (last <= first) continue;
    Condition condition{
        .family = ConditionFamily::kFrequency,
        .name = band == 0 ? "constant error"
                          : "frequency " + NumberText(limits_hz[band - 1]) + ".." + NumberText(limits_hz[band]) + " Hz",
        .share_of_time = 0};
    for (std::size_t k = std::max<std::size_t>(1, first); k < last; ++k) {
      condition.share_of_time += signal.power()[k] / signal_power;
    }
    conditions->list.push_back(std::move(condition));
    const std::vector<double> part = error.Part(first, last);
    std::vector<double>& column = conditions->columns.emplace_back(CellCount(used.size()));
    for (std::size_t i = 0; i < used.size(); ++i) {
      if (used[i]) column[i / RowsPerCell(used.size())] += part[i] * part[i];
    }
    first = last;
  }
}

// The families' places in `conditions`: first and one past the last.
std::vector<std::pair<std::size_t, std::size_t>> Families(const std::vector<Condition>& conditions) {
  std::vector<std::pair<std::size_t, std::size_t>> families;
  for (std::size_t c = 0; c < conditions.size(); ++c) {
    const bool next = families.empty() || conditions[families.back().first].family != conditions[c].family;
    if (next) families.push_back({c, c});
    families.back().second = c + 1;
  }
  return families;
}

// Shares of sums[first..last-1] in their total; all NaN when that is zero.
void Shares(std::span<const double> sums, std::pair<std::size_t, std::size_t> family, std::span<double> shares) {
  double total = 0;
  for (std::size_t c = family.first; c < family.second; ++c) total += sums[c];
  for (std::size_t c = family.first; c < family.second; ++c) shares[c] = total > 0 ? sums[c] / total : kNaN;
}

// Length of the bootstrap's blocks. What varies in a share s = S_c / S is, to first order, the sum of c_i - s e_i^2
// over the log: the slowest of these decides, but for the time windows, which are as slow as the log.
std::size_t BlockCells(const Conditions& conditions, const std::vector<double>& shares) {
  double slowest = 1;
  for (const auto& [first, last] : Families(conditions.list)) {
    if (conditions.list[first].family == ConditionFamily::kTime) continue;
    const std::size_t cells = conditions.columns[first].size();
    std::vector<double> whole(cells), influence(cells);
    for (std::size_t c = first; c < last; ++c) {
      for (std::size_t i = 0; i < cells; ++i) whole[i] += conditions.columns[c][i];
    }
    for (std::size_t c = first; c < last; ++c) {
      for (std::size_t i = 0; i < cells; ++i) influence[i] = conditions.columns[c][i] - shares[c] * whole[i];
      slowest = std::fmax(slowest, CorrelationTime(influence, 1.0));
    }
  }
  const double cells = static_cast<double>(conditions.columns.front().size());
  return static_cast<std::size_t>(
      std::max(1L, std::lround(std::clamp(kBlockCorrelationTimes * slowest, cells / 200, cells / 10))));
}

// How much wider an interval is than the bootstrap's, for three small-sample effects: Student's t for the normal
// distribution (Cornish-Fisher series), the variance of few draws, and the correlation cut where blocks meet (for an
// AR(1) a part 1 / (2 kBlockCorrelationTimes) of the variance).
double Widening(double blocks) {
  const double free = std::max(2.0, blocks - 1), z = kNormal95;
  const double student =
      z + (std::pow(z, 3) + z) / (4 * free) + (5 * std::pow(z, 5) + 16 * std::pow(z, 3) + 3 * z) / (96 * free * free);
  return student / z * std::sqrt((free + 1) / free) / std::sqrt(1 - 1 / (2 * kBlockCorrelationTimes));
}

// `bound` moved away from `share` by `factor` on the logistic scale, on which 0 and 1 stay where they are.
double Widen(double share, double bound, double factor) {
  if (!(share > 0 && share < 1 && bound > 0 && bound < 1)) return bound;
  const double centre = std::log(share / (1 - share)), edge = std::log(bound / (1 - bound));
  return 1 / (1 + std::exp(-(centre + factor * (edge - centre))));
}

void SetIntervals(const Conditions& conditions, std::size_t block, const ConditionOptions& options,
                  std::vector<ConditionShare>* result) {
  const std::size_t width = conditions.list.size();
  std::vector<double> drawn = ResampleSums(conditions.columns, block, options.replicates, options.seed);
  const auto families = Families(conditions.list);
  for (std::size_t start = 0; start < drawn.size(); start += width) {
    const std::span<double> row(&drawn[start], width);
    for (const auto& family : families) Shares(row, family, row);
  }
  const double widening = Widening(static_cast<double>(conditions.columns.front().size()) / static_cast<double>(block));
  std::vector<double> values;
  for (std::size_t c = 0; c < width; ++c) {
    values.clear();
    for (std::size_t start = 0; start < drawn.size(); start += width) {
      if (!std::isnan(drawn[start + c])) values.push_back(drawn[start + c]);
    }
    if (values.size() < 20) continue;
    ConditionShare& share = (*result)[c];
    share.low = Widen(share.share_of_error, Quantile(values, kLow), widening);
    share.high = Widen(share.share_of_error, Quantile(values, kHigh), widening);
  }
}

void CheckInput(const ConditionInput& input, const ConditionOptions& options) {
  const std::size_t n = input.time_s.size();
  GS_CHECK(input.measured.size() == n && input.predicted.size() == n && options.replicates >= 20);
  for (const auto& values : {input.speed, input.command, input.angle}) GS_CHECK(values.empty() || values.size() == n);
  GS_CHECK(std::all_of(input.time_s.begin(), input.time_s.end(), [](double t) { return std::isfinite(t); }));
  GS_CHECK(std::adjacent_find(input.time_s.begin(), input.time_s.end(), std::greater_equal<>()) == input.time_s.end());
}

}  // namespace

std::vector<ConditionShare> LocateError(const ConditionInput& input, const ConditionOptions& options) {
  CheckInput(input, options);
  const std::size_t n = input.time_s.size();
  std::vector<char> used(n);
  std::size_t used_rows = 0;
  for (std::size_t i = 0; i < n; ++i) {
    used[i] = static_cast<char>(std::isfinite(input.measured[i]) && std::isfinite(input.predicted[i]));
    used_rows += used[i] ? 1 : 0;
  }
  if (used_rows < kFewestRows) return {};
  const std::vector<double> errors = ScaledErrors(input, used);
  if (errors.empty()) return {};

  Conditions conditions;
  for (const Partition& partition : MakePartitions(input, used)) AddPartition(partition, errors, &conditions);
  if (used_rows >= kFewestRowsForFrequency) AddFrequencies(input, used, errors, &conditions);

  // Shares of the whole log, then their intervals. A family without any error has no shares.
  std::vector<double> totals = Collect(
      conditions.columns, [](const auto& column) { return std::accumulate(column.begin(), column.end(), 0.0); });
  for (const auto& family : Families(conditions.list)) Shares(totals, family, totals);
  std::vector<ConditionShare> result;
  for (std::size_t c = 0; c < totals.size(); ++c) {
    const Condition& condition = conditions.list[c];
    result.push_back({.signal = input.signal,
                      .condition = condition.name,
                      .share_of_error = totals[c],
                      .share_of_time = condition.share_of_time,
                      .low = kNaN,
                      .high = kNaN,
                      .family = condition.family});
  }
  if (used_rows >= kFewestRowsForInterval && !result.empty()) {
    SetIntervals(conditions, BlockCells(conditions, totals), options, &result);
  }
  std::erase_if(result, [](const ConditionShare& share) { return std::isnan(share.share_of_error); });
  return result;
}

std::vector<ConditionShare> MostTelling(std::span<const ConditionShare> shares, const TellingOptions& options) {
  std::vector<ConditionShare> telling;
  for (const ConditionShare& share : shares) {
    if (share.share_of_error >= options.least_share && share.low > share.share_of_time &&
        share.share_of_error >= options.least_ratio * share.share_of_time) {
      telling.push_back(share);
    }
  }
  std::stable_sort(telling.begin(), telling.end(), [](const ConditionShare& a, const ConditionShare& b) {
    const double excess_a = a.low - a.share_of_time, excess_b = b.low - b.share_of_time;
    if (excess_a != excess_b) return excess_a > excess_b;
    return std::tie(a.signal, a.family, a.condition) < std::tie(b.signal, b.family, b.condition);
  });
  std::map<std::pair<std::string, ConditionFamily>, std::size_t> taken;
  std::vector<ConditionShare> result;
  for (ConditionShare& share : telling) {
    if (result.size() >= options.limit) break;
    if (++taken[{share.signal, share.family}] <= options.per_family) result.push_back(std::move(share));
  }
  return result;
}

}  // namespace gapscope
