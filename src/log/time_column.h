// Which column is the time, and in what unit: by name, then by the size of the stamps and their steps.
#ifndef GAPSCOPE_LOG_TIME_COLUMN_H_
#define GAPSCOPE_LOG_TIME_COLUMN_H_

#include <string>
#include <string_view>

#include "src/core/result.h"
#include "src/log/log.h"

namespace gapscope {

// "t", "time", "Time_ms", "__time", "%time", "timestamp", "header.stamp" ...
bool IsTimeName(std::string_view name);

// Is `text` a unit that a heading may carry: one that ParseUnit knows, or one with a degree sign and the like?
bool LooksLikeUnit(std::string_view text);

// The time column named by the caller, the one that the file names, or the first one named like a time. Errors: none,
// or without any number.
Result<const Column*> FindTimeColumn(const Log& log, const std::string& wanted);

struct TimeUnit {
  std::string name;     // "s", "ms", "us", "ns", "min"
  double factor_s = 1;  // seconds per unit
  std::string guess;    // empty: stated by the caller, the heading or the name; else a sentence that says why
};

// The unit of the stamps, from the first of these that tells:
// 1. `wanted`, 2. the unit in the heading, 3. the name ("time_ms", "%time" is ns, "__time" is s),
// 4. stamps that lie between the years 2000 and 2100 when read as s, ms, us or ns since 1970,
// 5. the median step d of the raw numbers: below 1, seconds; else ms below 500, us below 500,000, ns above.
// Errors: not a unit of time.
Result<TimeUnit> FindTimeUnit(const Log& log, const Column& column, const std::string& wanted);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_TIME_COLUMN_H_
