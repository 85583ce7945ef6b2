#include "src/experiment/recording.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "src/core/names.h"
#include "src/experiment/expression.h"
#include "src/experiment/orientation.h"

namespace gapscope {
namespace {

const Column* FindFirst(const Log& log, const std::vector<std::string>& names) {
  for (const auto& name : names) {
    if (const Column* column = log.Find(name)) return column;
  }
  return nullptr;
}

// The columns of a signal: the first that the log has; of an orientation all four. None where one lacks.
std::vector<const Column*> ColumnsOf(const Log& log, const MeasuredSpec& spec) {
  std::vector<const Column*> columns;
  if (spec.kind != SignalKind::kOrientation) {
    if (const Column* column = FindFirst(log, spec.columns)) columns.push_back(column);
    return columns;
  }
  for (const std::string& name : spec.columns) {
    if (const Column* column = log.Find(name)) columns.push_back(column);
  }
  if (columns.size() != spec.columns.size()) columns.clear();
  return columns;
}

Error MissingColumn(const Log& log, const std::vector<std::string>& names, const std::string& purpose) {
  return Error{.what = "no column '" + names.front() + "' for " + purpose,
               .where = log.WhereHeader(),
               .actual = "columns " + Join(log.ColumnNames()),
               .cure = DidYouMean(names.front(), log.ColumnNames(), "name the right column in the experiment file")};
}

// Where stamps are made up, as in LeRobot's datasets, numbers are degrees or shares of a range, and nothing says which.
Status CheckUnit(const Log& log, const Column& column, bool stated) {
  if (stated || !column.unit.empty() || column.clock != "synthetic") return Ok();
  return Error{.what = "the unit of '" + column.name + "' is not stated",
               .where = log.path,
               .allowed = "'unit:' or 'scale:' beside the column in the experiment file; unit: 1 takes it as it stands",
               .cure = "find out what was recorded: degrees, or -100 to 100 of the calibrated range"};
}

// Leaves out what the experiment does not want: the first seconds, and what follows after the `while` column falls to
// zero. Time starts anew.
Status CutTimeline(const Experiment& experiment, const Log& log, Timeline* timeline) {
  const ReplayDefaults& replay = experiment.replay;
  std::size_t first = 0, last = timeline->time_s.size();
  while (first < last && timeline->time_s[first] < replay.start_s) ++first;
  if (!replay.while_column.empty()) {
    const Column* column = log.Find(replay.while_column);
    if (!column) return MissingColumn(log, {replay.while_column}, "'while'");
    std::size_t row = first;
    while (row < last && std::abs(column->values[timeline->rows[row]]) > 0) ++row;
    last = row;
  }
  if (last < first + 2) {
    return Error{.what = "the log has fewer than two rows left",
                 .where = log.path,
                 .actual = std::to_string(timeline->time_s.back()) + " s in all",
                 .cure = "see 'start_s' and 'while' of the experiment"};
  }
  if (first > 0) {
    timeline->findings.push_back({.kind = "cut",
                                  .column = "",
                                  .count = first,
                                  .first_row = timeline->rows[0],
                                  .text = std::to_string(first) + " rows before 'start_s' are left out"});
  }
  if (last < timeline->time_s.size()) {
    timeline->findings.push_back({.kind = "cut",
                                  .column = replay.while_column,
                                  .count = timeline->time_s.size() - last,
                                  .first_row = timeline->rows[last],
                                  .text = std::to_string(timeline->time_s.size() - last) + " rows after '" +
                                          replay.while_column + "' fell to zero are left out"});
  }
  timeline->time_s = std::vector<double>(timeline->time_s.begin() + static_cast<std::ptrdiff_t>(first),
                                         timeline->time_s.begin() + static_cast<std::ptrdiff_t>(last));
  timeline->rows = std::vector<std::size_t>(timeline->rows.begin() + static_cast<std::ptrdiff_t>(first),
                                            timeline->rows.begin() + static_cast<std::ptrdiff_t>(last));
  const double shift = timeline->time_s.front();
  for (double& t : timeline->time_s) t -= shift;
  return Ok();
}

Result<std::map<std::string, double>> BindValues(const Experiment& experiment, const Log& log) {
  std::map<std::string, double> values;
  for (const auto& spec : experiment.values) {
    if (const auto found = log.header.find(spec.header); !spec.header.empty() && found != log.header.end()) {
      values[spec.name] = spec.factor * found->second;
      continue;
    }
    if (const Column* column = spec.column.empty() ? nullptr : log.Find(spec.column)) {
      double sum = 0;
      std::size_t count = 0;
      for (const double x : column->values) {
        if (std::isfinite(x)) sum += x, ++count;
      }
      if (count > 0) {
        values[spec.name] = spec.factor * sum / static_cast<double>(count);
        continue;
      }
    }
    if (!spec.fallback) {
      return Error{.what = "the log has no " +
                           (spec.header.empty() ? "column '" + spec.column : "header value '" + spec.header) +
                           "', which gives '" + spec.name + "'",
                   .where = log.WhereHeader(),
                   .cure = "add 'default:' to it in the experiment file"};
    }
    values[spec.name] = *spec.fallback;
  }
  return values;
}

// Of a signal whose columns are not all there: the first that lacks.
Error MissingOf(const Log& log, const MeasuredSpec& spec) {
  std::vector<std::string> names = spec.columns;
  while (spec.kind == SignalKind::kOrientation && names.size() > 1 && log.Find(names.front()))
    names.erase(names.begin());
  return MissingColumn(log, names, "the signal '" + spec.signal + "'");
}

Status BindMeasured(const Experiment& experiment, const Log& log, const Timeline& timeline, Recording* recording) {
  for (std::size_t index = 0; index < experiment.measured.size(); ++index) {
    const MeasuredSpec& spec = experiment.measured[index];
    const std::vector<const Column*> columns = ColumnsOf(log, spec);
    if (columns.empty() && spec.optional) continue;
    if (columns.empty()) return MissingOf(log, spec);
    if (spec.kind == SignalKind::kOrientation) {
      if (spec.element > 0) continue;  // bound with the first
      GS_ASSIGN(auto turns, BindOrientation(experiment, index, log, timeline,
                                            {columns[0], columns[1], columns[2], columns[3]}, &recording->findings));
      for (auto& turn : turns) {
        turn.clock = columns.front()->clock;
        recording->measured.push_back(std::move(turn));
      }
      continue;
    }
    GS_RETURN_IF_ERROR(CheckUnit(log, *columns.front(), spec.unit_stated));
    Recording::Measured measured{
        .spec = spec, .index = index, .column = columns.front()->name, .values = {}, .clock = columns.front()->clock};
    const ColumnOptions options{.factor = spec.factor,
                                .offset = spec.offset,
                                .missing = experiment.timeline.missing,
                                .wrap = spec.wrap,
                                .wrap_period = spec.wrap_period};
    GS_ASSIGN(measured.values, ExtractColumn(log, timeline, *columns.front(), options, &recording->findings));
    recording->measured.push_back(std::move(measured));
  }
  return Ok();
}

}  // namespace

Result<Recording> LoadRecording(const Experiment& experiment, const std::string& log_path) {
  GS_ASSIGN(const Log log, ReadLog(log_path, experiment.read));
  return BindLog(experiment, log);
}

Result<Recording> BindLog(const Experiment& experiment, const Log& log) {
  if (log.joined && !experiment.timeline.missing_stated) {
    Experiment keeping = experiment;
    keeping.timeline.missing = MissingRepair::kKeep;
    keeping.timeline.missing_stated = true;
    return BindLog(keeping, log);
  }
  const std::string& log_path = log.path;
  TimelineOptions timeline_options = experiment.timeline;
  for (const auto& spec : experiment.commands) {
    if (const Column* column = FindFirst(log, spec.columns)) timeline_options.required.push_back(column->name);
  }
  for (const auto& spec : experiment.measured) {
    for (const Column* column : ColumnsOf(log, spec)) timeline_options.required.push_back(column->name);
  }
  GS_ASSIGN(Timeline timeline, BuildTimeline(log, timeline_options));
  GS_RETURN_IF_ERROR(CutTimeline(experiment, log, &timeline));
  Recording recording;
  recording.log_path = log_path;
  recording.rig = log.rig;
  recording.rows_in_log = log.rows();
  recording.findings = log.findings;
  recording.findings.insert(recording.findings.end(), timeline.findings.begin(), timeline.findings.end());
  recording.time_s = timeline.time_s;
  GS_ASSIGN(recording.values, BindValues(experiment, log));

  for (const auto& spec : experiment.commands) {
    Recording::Command command{.actuator = spec.actuator};
    if (const Column* column = FindFirst(log, spec.columns)) {
      GS_RETURN_IF_ERROR(CheckUnit(log, *column, spec.unit_stated));
      command.column = column->name;
      command.clock = column->clock;
      const MissingRepair missing = experiment.timeline.missing;
      const ColumnOptions options{.factor = spec.factor,
                                  .offset = spec.offset,
                                  .missing = missing == MissingRepair::kKeep ? MissingRepair::kHold : missing};
      GS_ASSIGN(command.values, ExtractColumn(log, timeline, *column, options, &recording.findings));
    } else if (spec.optional) {
      GS_ASSIGN(const double constant, EvaluateOnce(spec.fallback, recording.values,
                                                    experiment.path + ": default of command '" + spec.actuator + "'"));
      command.values.assign(recording.rows(), constant);
    } else {
      return MissingColumn(log, spec.columns, "the actuator '" + spec.actuator + "'");
    }
    recording.commands.push_back(std::move(command));
  }
  GS_RETURN_IF_ERROR(BindMeasured(experiment, log, timeline, &recording));
  if (std::none_of(recording.measured.begin(), recording.measured.end(), [](const auto& m) { return m.spec.scored; })) {
    return Error{.what = "the log has none of the signals that are scored",
                 .where = log_path,
                 .cure = "see 'measured:' in " + experiment.path};
  }
  recording.timeline = std::move(timeline);
  return recording;
}

}  // namespace gapscope
