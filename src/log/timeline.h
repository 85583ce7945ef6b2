// From a raw table to samples on a clean time axis: time in seconds from the first row, strictly increasing; every
// repair follows a named policy and is counted in a Finding.
#ifndef GAPSCOPE_LOG_TIMELINE_H_
#define GAPSCOPE_LOG_TIMELINE_H_

#include <string>
#include <vector>

#include "src/log/log.h"

namespace gapscope {

enum class TimeRepair { kError, kDropRows };             // stamps that repeat or go back
enum class MissingRepair { kError, kDropRows, kHold };   // NaN in a column that is used
enum class WrapRepair { kKeep, kUnwrap };                // an encoder angle that jumps by a whole turn

struct TimelineOptions {
  std::string time_column;      // empty: the first column named like a time ("time_s", "t", "timestamp", "__time", ...)
  std::string time_unit;        // "s", "ms", "us", "ns"; empty: from the name, then from the size of the steps
  TimeRepair repeated = TimeRepair::kDropRows;
  TimeRepair reversed = TimeRepair::kDropRows;
  MissingRepair missing = MissingRepair::kHold;
  double gap_factor = 5;        // a step longer than this many median steps is reported as a gap
};

struct Timeline {
  std::vector<double> time_s;     // from zero, strictly increasing
  std::vector<std::size_t> rows;  // row of the log for each stamp
  double start_s = 0;             // the log's own time at the first row
  std::string time_column, time_unit;
  double median_step_s = 0, shortest_step_s = 0, longest_step_s = 0, jitter_s = 0;  // jitter: standard deviation
  std::vector<Finding> findings;
};

// Errors: no time column, no unit that makes sense, fewer than two rows left, a policy of kError that was violated.
Result<Timeline> BuildTimeline(const Log& log, const TimelineOptions& options);

// One column on the timeline, scaled: value = factor * raw + offset. NaN are repaired by `missing` (kDropRows is
// treated as kError here: rows are dropped in BuildTimeline only for columns listed in `required`).
// `wrap_period` > 0 with kUnwrap removes jumps by that many SI units.
struct ColumnOptions {
  double factor = 1, offset = 0;
  MissingRepair missing = MissingRepair::kHold;
  WrapRepair wrap = WrapRepair::kKeep;
  double wrap_period = 0;
};
Result<std::vector<double>> ExtractColumn(const Log& log, const Timeline& timeline, const Column& column,
                                          const ColumnOptions& options, std::vector<Finding>* findings);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_TIMELINE_H_
