#include "src/experiment/recording.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "src/core/names.h"
#include "src/experiment/expression.h"

namespace gapscope {
namespace {

const Column* FindFirst(const Log& log, const std::vector<std::string>& names) {
  for (const auto& name : names) {
    if (const Column* column = log.Find(name)) return column;
  }
  return nullptr;
}

Error MissingColumn(const Log& log, const std::vector<std::string>& names, const std::string& purpose) {
  return Error{.what = "no column '" + names.front() + "' for " + purpose,
               .where = log.path + ":1",
               .actual = "columns " + Join(log.ColumnNames()),
               .cure = DidYouMean(names.front(), log.ColumnNames(), "name the right column in the experiment file")};
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
                   .where = log.path + ":1",
                   .cure = "add 'default:' to it in the experiment file"};
    }
    values[spec.name] = *spec.fallback;
  }
  return values;
}

}  // namespace

Result<Recording> LoadRecording(const Experiment& experiment, const std::string& log_path) {
  GS_ASSIGN(const Log log, ReadLog(log_path, experiment.read));
  TimelineOptions timeline_options = experiment.timeline;
  for (const auto& spec : experiment.commands) {
    if (const Column* column = FindFirst(log, spec.columns)) timeline_options.required.push_back(column->name);
  }
  for (const auto& spec : experiment.measured) {
    if (const Column* column = FindFirst(log, spec.columns)) timeline_options.required.push_back(column->name);
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
      command.column = column->name;
      const ColumnOptions options{.factor = spec.factor, .offset = spec.offset, .missing = experiment.timeline.missing};
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
  for (std::size_t index = 0; index < experiment.measured.size(); ++index) {
    const MeasuredSpec& spec = experiment.measured[index];
    const Column* column = FindFirst(log, spec.columns);
    if (!column && spec.optional) continue;
    if (!column) return MissingColumn(log, spec.columns, "the signal '" + spec.signal + "'");
    Recording::Measured measured{.spec = spec, .index = index, .column = column->name};
    const ColumnOptions options{.factor = spec.factor,
                                .offset = spec.offset,
                                .missing = experiment.timeline.missing,
                                .wrap = spec.wrap,
                                .wrap_period = spec.wrap_period};
    GS_ASSIGN(measured.values, ExtractColumn(log, timeline, *column, options, &recording.findings));
    recording.measured.push_back(std::move(measured));
  }
  if (std::none_of(recording.measured.begin(), recording.measured.end(), [](const auto& m) { return m.spec.scored; })) {
    return Error{.what = "the log has none of the signals that are scored",
                 .where = log_path,
                 .cure = "see 'measured:' in " + experiment.path};
  }
  recording.timeline = std::move(timeline);
  return recording;
}

namespace {

// A log that begins at rest: nothing leaves the first sample's count for the first 10 ms, or so much more of the way is
// made in the 40 ms after them (24 times at a constant acceleration from rest, 4 times at a constant speed) that the
// motion had only begun.
bool StartsAtRest(const Recording& recording, const Recording::Measured& measured) {
  constexpr double kBegin_s = 0.01, kEnd_s = 0.05, kFarther = 8;
  const auto& t = recording.time_s;
  const auto& values = measured.values;
  std::size_t k = 1;
  bool stays = true;
  for (; k < t.size() && (k < 3 || t[k] - t[0] <= kBegin_s); ++k)
    stays = stays && std::abs(values[k] - values[0]) <= 1.01 * measured.spec.resolution;
  if (stays) return true;
  std::size_t begin = 1, end = 1;
  while (begin + 1 < t.size() && t[begin] - t[0] < kBegin_s) ++begin;
  while (end + 1 < t.size() && t[end] - t[0] < kEnd_s) ++end;
  return kFarther * std::abs(values[begin] - values[0]) <= std::abs(values[end] - values[begin]);
}

}  // namespace

LocalFit FitLocally(const Recording& recording, const Recording::Measured& measured, std::size_t row,
                    double half_width_s) {
  if (row == 0 && std::isfinite(measured.values[0]) && StartsAtRest(recording, measured))
    return {measured.values[0], 0};
  const auto& t = recording.time_s;
  std::size_t first = row, last = row;
  while (first > 0 && t[row] - t[first - 1] <= half_width_s) --first;
  while (last + 1 < t.size() && t[last + 1] - t[row] <= half_width_s) ++last;
  // At least seven samples where there are, so that the quadratic does not follow single counts.
  while (last - first < 6 && (first > 0 || last + 1 < t.size())) {
    if (last + 1 < t.size()) ++last;
    if (last - first < 6 && first > 0) --first;
  }
  // Normal equations of y = a + b s + c s^2 with s = (t - t[row]) / scale.
  const double scale = std::max(t[last] - t[row], t[row] - t[first]);
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double squares = 0;
  int count = 0;
  for (std::size_t k = first; k <= last; ++k) {
    const double y = measured.values[k], s = scale > 0 ? (t[k] - t[row]) / scale : 0;
    if (!std::isfinite(y)) continue;
    const Eigen::Vector3d basis(1, s, s * s);
    normal += basis * basis.transpose();
    right += basis * y;
    squares += y * y;
    ++count;
  }
  if (count < 4) return {std::isfinite(measured.values[row]) ? measured.values[row] : 0, 0};
  const Eigen::Matrix3d inverse = normal.inverse();
  const Eigen::Vector3d fit = inverse * right;
  const double scatter = std::max(squares - fit.dot(right), 0.0) / (count - 3);
  const double quantisation = measured.spec.resolution * measured.spec.resolution / 12;
  const double slope_error = std::sqrt(std::max(scatter, quantisation) * inverse(1, 1));
  // A slope that the samples cannot tell from rest is rest: at a log's first row the fit is one-sided and weak.
  constexpr double kSignificant = 2;
  if (!(std::abs(fit[1]) > kSignificant * slope_error) && std::isfinite(measured.values[row]))
    return {measured.values[row], 0, std::sqrt(scatter), scale};
  return {fit[0], fit[1] / scale, std::sqrt(scatter), scale};
}

}  // namespace gapscope
