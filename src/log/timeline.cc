#include "src/log/timeline.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "src/core/statistics.h"
#include "src/log/time_column.h"

namespace gapscope {
namespace {

struct Stamp {
  double raw = 0;
  std::size_t row = 0;
};
using Stamps = std::vector<Stamp>;

constexpr double kShortestMedian_s = 1e-8, kLongestMedian_s = 1000;
constexpr std::size_t kResetRows = 3;  // this many rows below the old stamp make a restart; fewer are a glitch

Error Violated(const Log& log, const Column& column, std::size_t row, std::string what, std::string actual,
               const char* policy) {
  return Error{
      .what = std::move(what),
      .where = log.Where(row) + ", column " + column.name,
      .actual = std::move(actual),
      .allowed = "stamps that grow from row to row",
      .cure = fmt::format(
          "correct the log, or allow a repair in the experiment file: log: {{repair: {{{}: drop_rows}}}}", policy)};
}

// Rows that have a stamp (and, if asked, all required values).
Result<Stamps> CollectStamps(const Log& log, const Column& time, const TimelineOptions& options,
                             std::vector<Finding>* findings) {
  std::vector<const Column*> required;
  if (options.missing == MissingRepair::kDropRows) {
    for (const auto& name : options.required) {
      if (const Column* column = log.Find(name)) required.push_back(column);
    }
  }
  Stamps stamps;
  stamps.reserve(time.values.size());
  Finding no_stamp{.kind = "missing_stamp", .column = time.name, .text = ""},
      no_value{.kind = "missing", .column = "", .text = ""};
  for (std::size_t row = 0; row < time.values.size(); ++row) {
    if (!std::isfinite(time.values[row])) {
      if (options.missing == MissingRepair::kError) {
        return Violated(log, time, row, "a row without a time stamp", "nothing or nan", "missing");
      }
      if (no_stamp.count++ == 0) no_stamp.first_row = row;
      continue;
    }
    if (std::any_of(required.begin(), required.end(),
                    [&](const Column* c) { return !std::isfinite(c->values[row]); })) {
      if (no_value.count++ == 0) no_value.first_row = row;
      continue;
    }
    stamps.push_back({time.values[row], row});
  }
  no_stamp.text = fmt::format("{} of {} rows have no time stamp; dropped", no_stamp.count, log.rows());
  no_value.text =
      fmt::format("{} of {} rows have no value in a column that is used; dropped", no_value.count, log.rows());
  for (auto* finding : {&no_stamp, &no_value}) {
    if (finding->count > 0) findings->push_back(*finding);
  }
  return stamps;
}

double MedianPositiveStep(const Stamps& stamps) {
  std::vector<double> steps;
  for (std::size_t k = 1; k < stamps.size(); ++k) {
    if (stamps[k].raw > stamps[k - 1].raw) steps.push_back(stamps[k].raw - stamps[k - 1].raw);
  }
  if (steps.empty()) return 0;
  return Median(std::move(steps));
}

bool IsIncreasing(const Stamps& stamps) {
  return std::adjacent_find(stamps.begin(), stamps.end(),
                            [](const Stamp& a, const Stamp& b) { return !(a.raw < b.raw); }) == stamps.end();
}

// A counter of 16 or 32 bits that has run over goes on from zero: carried on.
void UnwrapCounter(double median, const std::string& column, Stamps* stamps, std::vector<Finding>* findings) {
  constexpr std::array kPeriods = {65536.0, 4294967296.0};
  const auto [low, high] =
      std::minmax_element(stamps->begin(), stamps->end(), [](const Stamp& a, const Stamp& b) { return a.raw < b.raw; });
  const double lowest = low->raw, highest = high->raw;
  for (const double period : kPeriods) {
    if (lowest < 0 || highest >= period || highest < 0.9 * period) continue;
    Finding finding{.kind = "clock_wrap", .column = column, .text = ""};
    double carried = 0, previous = stamps->front().raw;
    for (Stamp& stamp : *stamps) {
      const double over = stamp.raw + period - previous;
      if (stamp.raw < previous && over > 0 && over < 20 * median) {
        carried += period;
        if (finding.count++ == 0) finding.first_row = stamp.row;
      }
      previous = stamp.raw;
      stamp.raw += carried;
    }
    if (finding.count == 0) continue;
    finding.text =
        fmt::format("the clock, a counter up to {:.0f}, ran over {} times; carried on", period - 1, finding.count);
    findings->push_back(std::move(finding));
    return;
  }
}

// Where the clock starts again: back to (about) the start of the stretch, below several rows before and for several
// rows to come. (A single stamp far ahead or far back is neither.)
std::vector<std::size_t> FindResets(const Stamps& stamps) {
  std::vector<std::size_t> resets;
  std::size_t begin = 0;
  for (std::size_t k = kResetRows; k + kResetRows <= stamps.size(); ++k) {
    const double before = stamps[k - 1].raw, first = stamps[begin].raw;
    if (stamps[k].raw >= before || stamps[k].raw - first > 0.1 * (before - first)) continue;
    if (k < begin + kResetRows || stamps[k].raw > stamps[k - kResetRows].raw) continue;
    bool stays = true;
    for (std::size_t j = k; j < k + kResetRows; ++j)
      stays &= stamps[j].raw < before && (j == k || stamps[j].raw >= stamps[j - 1].raw);
    if (!stays) continue;
    resets.push_back(k);
    begin = k;
  }
  return resets;
}

// The longest strictly increasing subsequence; the first of equal stamps. O(n log n).
Stamps LongestIncreasing(const Stamps& stamps) {
  constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::vector<std::size_t> tails, before(stamps.size(), kNone);
  for (std::size_t k = 0; k < stamps.size(); ++k) {
    const auto at = std::lower_bound(tails.begin(), tails.end(), stamps[k].raw,
                                     [&](std::size_t i, double raw) { return stamps[i].raw < raw; });
    if (at != tails.end() && stamps[*at].raw == stamps[k].raw) continue;
    if (at != tails.begin()) before[k] = *(at - 1);
    if (at == tails.end()) {
      tails.push_back(k);
    } else {
      *at = k;
    }
  }
  Stamps kept(tails.size());
  std::size_t k = tails.empty() ? kNone : tails.back();
  for (std::size_t i = tails.size(); i-- > 0; k = before[k]) kept[i] = stamps[k];
  return kept;
}

Result<Stamps> Repair(const Log& log, const Column& time, const TimelineOptions& options, Stamps stamps,
                      std::vector<Finding>* findings) {
  if (IsIncreasing(stamps)) return stamps;
  if (options.reversed == TimeRepair::kDropRows)
    UnwrapCounter(MedianPositiveStep(stamps), time.name, &stamps, findings);
  const std::vector<std::size_t> resets = FindResets(stamps);
  Finding reset{.kind = "clock_reset", .column = time.name, .text = ""};
  Finding reversal{.kind = "time_reversal", .column = time.name, .text = ""};
  Finding repeat{.kind = "repeated_stamp", .column = time.name, .text = ""};
  for (std::size_t k = 1; k < stamps.size(); ++k) {
    const bool equal = stamps[k].raw == stamps[k - 1].raw;
    if (!equal && stamps[k].raw > stamps[k - 1].raw) continue;
    if ((equal ? options.repeated : options.reversed) == TimeRepair::kError) {
      return Violated(log, time, stamps[k].row, equal ? "a time stamp that repeats" : "time goes back",
                      fmt::format("{:.10g} after {:.10g}", stamps[k].raw, stamps[k - 1].raw),
                      equal ? "repeated" : "reversed");
    }
    Finding* finding = equal ? &repeat : std::binary_search(resets.begin(), resets.end(), k) ? &reset : &reversal;
    if (finding->count++ == 0) finding->first_row = stamps[k].row;
  }
  if (!resets.empty()) {
    std::vector<std::size_t> bounds = {0};
    bounds.insert(bounds.end(), resets.begin(), resets.end());
    bounds.push_back(stamps.size());
    std::size_t best = 0;
    for (std::size_t i = 0; i + 1 < bounds.size(); ++i) {
      if (bounds[i + 1] - bounds[i] > bounds[best + 1] - bounds[best]) best = i;
    }
    const std::size_t before = stamps.size();
    stamps = Stamps(stamps.begin() + static_cast<std::ptrdiff_t>(bounds[best]),
                    stamps.begin() + static_cast<std::ptrdiff_t>(bounds[best + 1]));
    reset.text =
        fmt::format("the clock starts again {} times; the longest stretch was kept (rows {} to {}), {} rows dropped",
                    reset.count, stamps.front().row, stamps.back().row, before - stamps.size());
  }
  const std::size_t before = stamps.size();
  stamps = LongestIncreasing(stamps);
  const std::size_t dropped = before - stamps.size();
  reversal.text = fmt::format("time goes back {} times; {} rows with stamps out of order or repeated were dropped",
                              reversal.count, dropped);
  repeat.text = fmt::format("{} rows repeat the stamp before; {} rows dropped in all, the first of equal ones kept",
                            repeat.count, dropped);
  for (auto* finding : {&reset, &reversal, &repeat}) {
    if (finding->count > 0) findings->push_back(std::move(*finding));
  }
  return stamps;
}

// Median, extremes, gaps, jitter.
void Measure(double gap_factor, Timeline* timeline) {
  const auto& t = timeline->time_s;
  std::vector<double> steps(t.size() - 1);
  for (std::size_t k = 0; k + 1 < t.size(); ++k) steps[k] = t[k + 1] - t[k];
  timeline->median_step_s = Median(steps);
  const auto [shortest, longest] = std::minmax_element(steps.begin(), steps.end());
  timeline->shortest_step_s = *shortest;
  timeline->longest_step_s = *longest;

  Finding gap{.kind = "gap", .column = timeline->time_column, .text = ""},
      irregular{.kind = "irregular", .column = timeline->time_column, .text = ""};
  double sum = 0, gap_time_s = 0;
  std::size_t regular = 0;
  const double limit_s = gap_factor * timeline->median_step_s;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    if (steps[k] > limit_s) {
      if (gap.count++ == 0) gap.first_row = timeline->rows[k];
      gap_time_s += steps[k];
      continue;
    }
    sum += steps[k];
    ++regular;
    if (std::abs(steps[k] - timeline->median_step_s) > 0.2 * timeline->median_step_s && irregular.count++ == 0)
      irregular.first_row = timeline->rows[k];
  }
  const double mean = regular > 0 ? sum / static_cast<double>(regular) : 0;
  double squares = 0;
  for (const double step : steps) squares += step > limit_s ? 0 : (step - mean) * (step - mean);
  timeline->jitter_s = regular > 1 ? std::sqrt(squares / static_cast<double>(regular - 1)) : 0;
  if (gap.count > 0) {
    gap.text = fmt::format(
        "{} steps are longer than {:g} median steps of {:.4g} s, {:.4g} s together, the longest {:.4g} s; kept, the "
        "last command holds",
        gap.count, gap_factor, timeline->median_step_s, gap_time_s, timeline->longest_step_s);
    timeline->findings.push_back(std::move(gap));
  }
  if (100 * irregular.count > steps.size()) {
    irregular.text =
        fmt::format("{} of {} steps differ from the median of {:.4g} s by more than 20 %; each stamp is used as it is",
                    irregular.count, steps.size(), timeline->median_step_s);
    timeline->findings.push_back(std::move(irregular));
  }
}

}  // namespace

Result<Timeline> BuildTimeline(const Log& log, const TimelineOptions& options) {
  GS_ASSIGN(const Column* const time, FindTimeColumn(log, options.time_column));
  GS_ASSIGN(const TimeUnit unit, FindTimeUnit(log, *time, options.time_unit));
  Timeline timeline;
  timeline.time_column = time->name;
  timeline.time_unit = unit.name;
  GS_ASSIGN(Stamps stamps, CollectStamps(log, *time, options, &timeline.findings));
  if (!stamps.empty()) {
    GS_ASSIGN(stamps, Repair(log, *time, options, std::move(stamps), &timeline.findings));
  }
  if (stamps.size() < 2) {
    return Error{.what = "fewer than two rows with stamps that grow",
                 .where = log.Where(0) + ", column " + time->name,
                 .actual = fmt::format("{} of {} rows left", stamps.size(), log.rows()),
                 .allowed = "two or more",
                 .cure = "is this the right time column, and the whole recording?"};
  }
  timeline.start_s = stamps.front().raw * unit.factor_s;
  for (const Stamp& stamp : stamps) {
    timeline.time_s.push_back((stamp.raw - stamps.front().raw) * unit.factor_s);
    timeline.rows.push_back(stamp.row);
  }
  Measure(options.gap_factor, &timeline);
  if (!std::isfinite(timeline.time_s.back()) || timeline.median_step_s < kShortestMedian_s ||
      timeline.median_step_s > kLongestMedian_s || !(timeline.shortest_step_s > 0)) {
    return Error{
        .what = "the time makes no sense in " + unit.name,
        .where = log.Where(0) + ", column " + time->name,
        .actual =
            fmt::format("median step {:.4g} s, whole time {:.4g} s", timeline.median_step_s, timeline.time_s.back()),
        .allowed = fmt::format("a median step of {:g} to {:g} s", kShortestMedian_s, kLongestMedian_s),
        .cure = "state the column's unit in the experiment file: log: {time: {column: " + time->name + ", unit: ms}}"};
  }
  if (!unit.guess.empty()) {
    timeline.findings.push_back({"time_unit", time->name, 1, stamps.front().row,
                                 fmt::format("time was {}: {:.4g} s per row", unit.guess, timeline.median_step_s)});
  } else if (timeline.median_step_s >= 1 || timeline.median_step_s < 1e-5) {
    timeline.findings.push_back({"time_unit_doubt", time->name, 1, stamps.front().row,
                                 fmt::format("the stated unit {} makes the median step {:.4g} s: is it right?",
                                             unit.name, timeline.median_step_s)});
  }
  return timeline;
}

}  // namespace gapscope
