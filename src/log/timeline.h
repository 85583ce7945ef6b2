// From a raw table to samples on a clean time axis: time in seconds from the first row, strictly increasing; every
// repair follows a named policy and is counted in a Finding.
#ifndef GAPSCOPE_LOG_TIMELINE_H_
#define GAPSCOPE_LOG_TIMELINE_H_

#include <string>
#include <vector>

#include "src/log/log.h"

namespace gapscope {

// Stamps that repeat or go back. kDropRows drops as few rows as make the rest strictly increasing (of equal stamps the
// first row stays). Where the clock starts again for several rows (a reset, or recordings joined), the longest stretch
// between such places is kept. A counter of 16 or 32 bits that wraps is carried on: no row is lost.
enum class TimeRepair { kError, kDropRows };
// NaN in a column that is used. kKeep: a measured value that is not there stays so, and its row is not compared, fitted
// or used for noise; commands are held.
enum class MissingRepair { kError, kDropRows, kHold, kKeep };
enum class WrapRepair { kKeep, kUnwrap };  // an encoder angle that jumps by a whole turn

struct TimelineOptions {
  std::string time_column =
      {};                      // empty: the first column named like a time ("time_s", "t", "timestamp", "__time", ...)
  std::string time_unit = {};  // "s", "ms", "us", "ns"; empty: from the name, then from the size of the steps
  TimeRepair repeated = TimeRepair::kDropRows;
  TimeRepair reversed = TimeRepair::kDropRows;
  // For rows without a stamp kHold and kKeep mean kDropRows: a time cannot be held.
  MissingRepair missing = MissingRepair::kHold;
  bool missing_stated = false;  // by the experiment; else a log of several rates (Log::joined) takes kKeep
  std::vector<std::string> required =
      {};                 // with missing = kDropRows: rows with NaN in any of these columns are dropped
  double gap_factor = 5;  // a step longer than this many median steps is reported as a gap
};

struct Timeline {
  std::vector<double> time_s;     // from zero, strictly increasing
  std::vector<std::size_t> rows;  // row of the log for each stamp
  double start_s = 0;             // the log's own time at the first row
  std::string time_column, time_unit;
  // Of the steps that were kept. jitter: standard deviation of the steps that are not gaps.
  double median_step_s = 0, shortest_step_s = 0, longest_step_s = 0, jitter_s = 0;
  std::vector<Finding> findings;
};

// How the time column and its unit are found: src/log/time_column.h. Findings: "missing_stamp", "missing" (rows
// dropped), "clock_wrap", "clock_reset", "time_reversal", "repeated_stamp", "gap", "irregular", "time_unit",
// "time_unit_doubt". Errors: no time column, no unit that makes sense (median step within 10 ns .. 1000 s), fewer than
// two rows left, a policy of kError that was violated.
Result<Timeline> BuildTimeline(const Log& log, const TimelineOptions& options);

// One column on the timeline, scaled: value = factor * raw + offset. NaN are repaired by `missing` (kDropRows is
// treated as kError here: rows are dropped in BuildTimeline only for columns listed in `required`).
// Values before the first one that is there take that one. `wrap_period` > 0 with kUnwrap removes jumps by that many SI
// units, taking each step as the shortest way round: right while the angle moves less than half a turn between rows.
// Findings: "held" and "kept" (of a missing value), "wrap" (also with kKeep, then as a warning), "saturation".
// Errors: a NaN under kError or kDropRows, no value at all, a value that is not finite once scaled.
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
