#include "src/log/time_column.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "src/core/names.h"
#include "src/core/statistics.h"
#include "src/core/units.h"
#include "src/log/text.h"

namespace gapscope {
namespace {

struct UnitWord {
  std::string_view word, unit;
};
constexpr std::array kUnitWords = {
    UnitWord{"s", "s"},
    UnitWord{"sec", "s"},
    UnitWord{"secs", "s"},
    UnitWord{"second", "s"},
    UnitWord{"seconds", "s"},
    UnitWord{"ms", "ms"},
    UnitWord{"msec", "ms"},
    UnitWord{"millis", "ms"},
    UnitWord{"milliseconds", "ms"},
    UnitWord{"us", "us"},
    UnitWord{"usec", "us"},
    UnitWord{"micros", "us"},
    UnitWord{"microseconds", "us"},
    UnitWord{"\xC2\xB5s", "us"},
    UnitWord{"\xCE\xBCs", "us"},
    UnitWord{"ns", "ns"},
    UnitWord{"nsec", "ns"},
    UnitWord{"nanos", "ns"},
    UnitWord{"nanoseconds", "ns"},
    UnitWord{"min", "min"},
    UnitWord{"minutes", "min"},
};
constexpr std::array<std::string_view, 19> kTimeWords = {
    "t",           "time",     "timestamp", "timestamps",   "time_stamp", "stamp",    "elapsed", "elapsed_time",
    "elapsedtime", "sim_time", "simtime",   "header.stamp", "clock",      "log_time", "zeit",    "temps",
    "tiempo",      "tempo",    "tick"};

// One of the units of kUnitWords.
double SecondsPer(std::string_view unit) {
  if (unit == "s") return 1;
  if (unit == "ms") return 1e-3;
  if (unit == "us") return 1e-6;
  if (unit == "ns") return 1e-9;
  GS_CHECK(unit == "min");
  return 60;
}

std::string_view UnitOfWord(std::string_view word) {
  for (const auto& known : kUnitWords) {
    if (word == known.word) return known.unit;
  }
  return {};
}

// Lower case, without '%', '/' and '_' in front and what stands in brackets behind.
std::string Normalised(std::string_view name) {
  std::string lower = ToLower(TrimBlanks(name));
  lower.erase(0, std::min(lower.find_first_not_of("%_/ "), lower.size()));
  for (const char open : {'[', '('}) {
    if (const auto at = lower.find(open); at != std::string::npos && at > 0) lower.erase(at);
  }
  for (char& c : lower) {
    if (c == ' ' || c == '-') c = '_';
  }
  while (!lower.empty() && lower.back() == '_') lower.pop_back();
  return lower;
}

bool IsTimeWord(std::string_view word) {
  return std::find(kTimeWords.begin(), kTimeWords.end(), word) != kTimeWords.end();
}

// "time_ms" -> "time" and "ms"; "timestampNs" too; "millis" alone is a time in ms.
std::pair<std::string, std::string_view> SplitUnitSuffix(const std::string& name) {
  if (const auto unit = UnitOfWord(name); !unit.empty() && name.size() > 3) return {"time", unit};
  if (const auto at = name.rfind('_'); at != std::string::npos) {
    if (const auto unit = UnitOfWord(name.substr(at + 1)); !unit.empty()) return {name.substr(0, at), unit};
  }
  for (const auto& known : kUnitWords) {
    if (!name.ends_with(known.word)) continue;
    const std::string stem = name.substr(0, name.size() - known.word.size());
    if (stem.size() > 1 && IsTimeWord(stem) && name != "timestamps") return {stem, known.unit};
  }
  return {name, {}};
}

bool IsLooselyTimeName(std::string_view name) {
  const std::string stem = SplitUnitSuffix(Normalised(name)).first;
  return stem.starts_with("time") || stem.ends_with("time") || stem.ends_with("timestamp") || stem.ends_with("stamp");
}

// Median of the positive steps of the raw stamps, and one finite stamp; nothing when there is no step.
struct RawSteps {
  double median = 0, first = 0;
};
std::optional<RawSteps> MedianRawStep(const Column& column) {
  std::vector<double> steps;
  std::optional<double> previous;
  double first = 0;
  for (const double t : column.values) {
    if (!std::isfinite(t)) continue;
    if (!previous) first = t;
    if (previous && t > *previous) steps.push_back(t - *previous);
    previous = t;
  }
  if (steps.empty()) return std::nullopt;
  return RawSteps{Median(std::move(steps)), first};
}

TimeUnit Guess(const Column& column) {
  const auto steps = MedianRawStep(column);
  if (!steps) return {"s", 1, "taken to be in seconds"};
  // Wall-clock stamps betray their unit: the years 2000 to 2100 in seconds since 1970.
  constexpr double kYear2000_s = 946684800, kYear2100_s = 4102444800;
  for (const char* unit : {"s", "ms", "us", "ns"}) {
    const double factor = SecondsPer(unit), stamp_s = steps->first * factor;
    if (stamp_s >= kYear2000_s && stamp_s < kYear2100_s) {
      return {unit, factor,
              fmt::format("taken to be in {}, since its first value {:.10g} is then a date", unit, steps->first)};
    }
  }
  const char* unit = steps->median < 1 ? "s" : steps->median < 500 ? "ms" : steps->median < 5e5 ? "us" : "ns";
  return {unit, SecondsPer(unit), fmt::format("taken to be in {}, from its median step {:.6g}", unit, steps->median)};
}

std::string Joined(const std::vector<std::string>& names) {
  std::string all;
  for (std::size_t k = 0; k < names.size() && k < 30; ++k) all += (k ? ", " : "") + Quoted(names[k]);
  if (names.size() > 30) all += fmt::format(" and {} more", names.size() - 30);
  return all;
}

}  // namespace

bool IsTimeName(std::string_view name) { return IsTimeWord(SplitUnitSuffix(Normalised(name)).first); }

bool LooksLikeUnit(std::string_view text) {
  if (text.empty() || text.size() > 20) return false;
  if (text == "-" || text == "s" || !UnitOfWord(ToLower(text)).empty() || ParseUnit(text).ok()) return true;
  static constexpr std::array<std::string_view, 24> kMore = {"\xC2\xB0",
                                                             "\xC2\xB0/s",
                                                             "\xC2\xB0"
                                                             "C",
                                                             "C",
                                                             "K",
                                                             "degrees",
                                                             "radians",
                                                             "radian",
                                                             "degree",
                                                             "Hz",
                                                             "volt",
                                                             "volts",
                                                             "amp",
                                                             "amps",
                                                             "kV",
                                                             "N*m",
                                                             "N.m",
                                                             "N\xC2\xB7m",
                                                             "rad/sec",
                                                             "deg/sec",
                                                             "rad/s2",
                                                             "m/s2",
                                                             "m/s^2",
                                                             "counts"};
  return std::find(kMore.begin(), kMore.end(), text) != kMore.end();
}

Result<const Column*> FindTimeColumn(const Log& log, const std::string& wanted) {
  const Column* found = log.time_column.empty() ? nullptr : log.Find(log.time_column);
  if (!wanted.empty()) {
    found = log.Find(wanted);
    if (!found) {
      return Error{.what = "no column '" + wanted + "' for the time",
                   .where = log.WhereHeader(),
                   .actual = "columns " + Joined(log.ColumnNames()),
                   .allowed = "",
                   .cure = DidYouMean(wanted, log.ColumnNames(), "name the time column in the experiment file")};
    }
  }
  for (const auto& column : log.columns) {
    if (!found && IsTimeName(column.name)) found = &column;
  }
  for (const auto& column : log.columns) {
    if (!found && IsLooselyTimeName(column.name)) found = &column;
  }
  if (!found) {
    return Error{.what = "no time column",
                 .where = log.WhereHeader(),
                 .actual = "columns " + Joined(log.ColumnNames()),
                 .allowed = "a column named time_s, t, time, timestamp, __time ...",
                 .cure = "name it in the experiment file: log: {time: {column: NAME, unit: s}}"};
  }
  if (std::none_of(found->values.begin(), found->values.end(), [](double t) { return std::isfinite(t); })) {
    return Error{.what = "the time column '" + found->name + "' holds no number at all",
                 .where = log.Where(0),
                 .actual = fmt::format("{} rows without a stamp", found->values.size()),
                 .allowed = "a stamp in every row",
                 .cure = "name another time column in the experiment file: log: {time: {column: NAME, unit: s}}"};
  }
  return found;
}

Result<TimeUnit> FindTimeUnit(const Log& log, const Column& column, const std::string& wanted) {
  const std::string stated = !wanted.empty() ? wanted : column.unit;
  if (!stated.empty()) {
    const std::string_view unit = UnitOfWord(ToLower(stated));
    if (unit.empty()) {
      return Error{.what = "'" + stated + "' is not a unit of time",
                   .where = log.WhereHeader() + ", column " + column.name,
                   .actual = "",
                   .allowed = "s, ms, us, ns, min",
                   .cure = "correct it, or state the unit in the experiment file"};
    }
    return TimeUnit{std::string(unit), SecondsPer(unit), ""};
  }
  const std::string_view trimmed = TrimBlanks(column.name);
  if (trimmed == "%time") return TimeUnit{"ns", 1e-9, ""};
  if (trimmed == "__time") return TimeUnit{"s", 1, ""};
  const auto [stem, unit] = SplitUnitSuffix(Normalised(column.name));
  if (!unit.empty()) return TimeUnit{std::string(unit), SecondsPer(unit), ""};
  return Guess(column);
}

}  // namespace gapscope
