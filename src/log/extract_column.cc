// ExtractColumn of timeline.h: one column as SI values on the timeline.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "src/core/statistics.h"
#include "src/log/signal_checks.h"
#include "src/log/timeline.h"

namespace gapscope {
namespace {

// Fills the gaps between values; `values` has at least one.
void Hold(std::vector<double>* values) {
  double last = *std::find_if(values->begin(), values->end(), [](double x) { return std::isfinite(x); });
  for (double& x : *values) {
    if (std::isfinite(x)) last = x;
    x = last;
  }
}

Finding RepairOf(const Column& column, std::size_t missing, std::size_t first, std::size_t rows, bool held) {
  return {held ? "held" : "kept", column.name, missing, first,
          fmt::format("no value in {} of {} rows; {}", missing, rows,
                      held ? "the last value before was held" : "those rows of it are not used")};
}

void ReportWraps(const Column& column, const Timeline& timeline, const ColumnOptions& options,
                 std::vector<double>* values, std::vector<Finding>* findings) {
  const bool known = options.wrap_period > 0;
  const double period = known ? options.wrap_period : 2 * std::numbers::pi;
  const Wraps wraps = known ? FindWraps(*values, period) : FindUndeclaredWraps(*values, period);
  if (wraps.count == 0) return;
  std::string text = fmt::format("jumps by about {:.6g} between neighbours", period);
  if (known && options.wrap == WrapRepair::kUnwrap) {
    Unwrap(period, values);
    text += fmt::format(" were taken as wraps of the encoder and removed ({} of {} are not sure)", wraps.unsure,
                        wraps.count);
  } else {
    text += " look like wraps of the encoder; kept as they are: state 'wrap' for this column to remove them";
  }
  if (findings) findings->push_back({"wrap", column.name, wraps.count, timeline.rows[wraps.first], std::move(text)});
}

}  // namespace

Result<std::vector<double>> ExtractColumn(const Log& log, const Timeline& timeline, const Column& column,
                                          const ColumnOptions& options, std::vector<Finding>* findings) {
  std::vector<double> values;
  values.reserve(timeline.rows.size());
  std::size_t missing = 0, first_missing = 0;
  for (const std::size_t row : timeline.rows) {
    GS_CHECK(row < column.values.size());
    const double raw = column.values[row];
    const double value = options.factor * raw + options.offset;
    if (!std::isfinite(raw)) {
      if (missing++ == 0) first_missing = row;
      values.push_back(kNaN);
      continue;
    }
    if (!std::isfinite(value)) {
      return Error{.what = "a value too large once converted",
                   .where = log.Where(row) + ", column " + column.name,
                   .actual = fmt::format("{:g}", raw),
                   .allowed = "at most 1.8e308 in size",
                   .cure = "correct the value or the column's unit and scale"};
    }
    values.push_back(value);
  }
  if (missing == values.size()) {
    return Error{.what = "a column without any value",
                 .where = log.WhereHeader() + ", column " + column.name,
                 .actual = fmt::format("{} rows, none with a number", values.size()),
                 .allowed = "numbers",
                 .cure = "choose another column, or leave this one out of the experiment file"};
  }
  if (missing > 0) {
    const bool held = options.missing == MissingRepair::kHold;
    if (!held && options.missing != MissingRepair::kKeep) {
      return Error{.what = "a missing value",
                   .where = log.Where(first_missing) + ", column " + column.name,
                   .actual = fmt::format("no value in {} of {} rows", missing, values.size()),
                   .allowed = "a value in every row",
                   .cure = "allow a repair in the experiment file: log: {repair: {missing: hold}}"};
    }
    if (held) Hold(&values);
    if (findings) findings->push_back(RepairOf(column, missing, first_missing, values.size(), held));
  }
  const Saturation saturation = FindSaturation(values);
  ReportWraps(column, timeline, options, &values, findings);
  if (saturation.count > 0 && findings) {
    const std::string where = saturation.at_low && saturation.at_high
                                  ? fmt::format("{:.6g} or {:.6g}", saturation.low, saturation.high)
                                  : fmt::format("{:.6g}", saturation.at_high ? saturation.high : saturation.low);
    findings->push_back(
        {"saturation", column.name, saturation.count, timeline.rows[saturation.first],
         fmt::format("stays at its limit {} in {} of {} rows; kept as it is", where, saturation.count, values.size())});
  }
  return values;
}

}  // namespace gapscope
