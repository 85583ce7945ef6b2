#include "src/experiment/recording.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "src/core/units.h"
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
  std::string all;
  for (const auto& name : log.ColumnNames()) all += (all.empty() ? "" : ", ") + name;
  const std::string nearest = Nearest(names.front(), log.ColumnNames());
  return Error{.what = "no column '" + names.front() + "' for " + purpose, .where = log.path + ":1", .actual = "columns " + all,
               .cure = nearest.empty() ? "name the right column in the experiment file" : "did you mean '" + nearest + "'?"};
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
      return Error{.what = "the log has no " + (spec.header.empty() ? "column '" + spec.column : "header value '" + spec.header) + "', which gives '" + spec.name + "'",
                   .where = log.path + ":1", .cure = "add 'default:' to it in the experiment file"};
    }
    values[spec.name] = *spec.fallback;
  }
  return values;
}

}  // namespace

Result<Recording> LoadRecording(const Experiment& experiment, const std::string& log_path) {
  GS_ASSIGN(const Log log, ReadLog(log_path, experiment.read));
  GS_ASSIGN(Timeline timeline, BuildTimeline(log, experiment.timeline));
  if (experiment.replay.start_s > 0) {
    // Leave out the first seconds that the experiment does not want; time starts anew.
    std::size_t first = 0;
    while (first < timeline.time_s.size() && timeline.time_s[first] < experiment.replay.start_s) ++first;
    if (first + 2 > timeline.time_s.size()) {
      return Error{.what = "the log ends before replay.start_s", .where = log_path, .actual = std::to_string(timeline.time_s.back()) + " s",
                   .allowed = "more than " + std::to_string(experiment.replay.start_s) + " s"};
    }
    const double shift = timeline.time_s[first];
    timeline.time_s.erase(timeline.time_s.begin(), timeline.time_s.begin() + static_cast<std::ptrdiff_t>(first));
    timeline.rows.erase(timeline.rows.begin(), timeline.rows.begin() + static_cast<std::ptrdiff_t>(first));
    for (double& t : timeline.time_s) t -= shift;
  }
  Recording recording;
  recording.log_path = log_path;
  recording.findings = log.findings;
  recording.findings.insert(recording.findings.end(), timeline.findings.begin(), timeline.findings.end());
  recording.time_s = timeline.time_s;
  GS_ASSIGN(recording.values, BindValues(experiment, log));

  for (const auto& spec : experiment.commands) {
    Recording::Command command{.actuator = spec.actuator, .column = "constant"};
    if (const Column* column = FindFirst(log, spec.columns)) {
      command.column = column->name;
      const ColumnOptions options{.factor = spec.factor, .offset = spec.offset, .missing = experiment.timeline.missing};
      GS_ASSIGN(command.values, ExtractColumn(log, timeline, *column, options, &recording.findings));
    } else if (spec.optional) {
      GS_ASSIGN(const double constant, EvaluateOnce(spec.fallback, recording.values, experiment.path + ": default of command '" + spec.actuator + "'"));
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
    const ColumnOptions options{.factor = spec.factor, .offset = spec.offset, .missing = experiment.timeline.missing, .wrap = spec.wrap, .wrap_period = spec.wrap_period};
    GS_ASSIGN(measured.values, ExtractColumn(log, timeline, *column, options, &recording.findings));
    recording.measured.push_back(std::move(measured));
  }
  if (std::none_of(recording.measured.begin(), recording.measured.end(), [](const auto& m) { return m.spec.scored; })) {
    return Error{.what = "the log has none of the signals that are scored", .where = log_path, .cure = "see 'measured:' in " + experiment.path};
  }
  recording.timeline = std::move(timeline);
  return recording;
}

LocalFit FitLocally(const Recording& recording, const Recording::Measured& measured, std::size_t row, double half_width_s) {
  const auto& t = recording.time_s;
  std::size_t first = row, last = row;
  while (first > 0 && t[row] - t[first - 1] <= half_width_s) --first;
  while (last + 1 < t.size() && t[last + 1] - t[row] <= half_width_s) ++last;
  // At least five samples, so that the quadratic does not follow single counts.
  while (last - first < 4 && (first > 0 || last + 1 < t.size())) {
    if (last + 1 < t.size()) ++last;
    if (last - first < 4 && first > 0) --first;
  }
  // Normal equations of y = a + b s + c s^2 with s = t - t[row], scaled to +-1.
  const double scale = std::max(t[last] - t[row], t[row] - t[first]);
  if (!(scale > 0)) return {measured.values[row], 0};
  std::array<double, 5> moment{};
  std::array<double, 3> right{};
  for (std::size_t k = first; k <= last; ++k) {
    if (!std::isfinite(measured.values[k])) continue;
    const double s = (t[k] - t[row]) / scale;
    double power = 1;
    for (int p = 0; p < 5; ++p, power *= s) {
      moment[p] += power;
      if (p < 3) right[p] += power * measured.values[k];
    }
  }
  std::array<std::array<double, 4>, 3> m{};
  const int order = moment[0] >= 5 ? 3 : moment[0] >= 2 ? 2 : 1;
  if (moment[0] == 0) return {0, 0};
  for (int i = 0; i < order; ++i) {
    for (int j = 0; j < order; ++j) m[i][j] = moment[i + j];
    m[i][3] = right[i];
  }
  for (int i = 0; i < order; ++i) {
    int pivot = i;
    for (int r = i + 1; r < order; ++r) {
      if (std::abs(m[r][i]) > std::abs(m[pivot][i])) pivot = r;
    }
    std::swap(m[i], m[pivot]);
    if (m[i][i] == 0) return {right[0] / moment[0], 0};
    for (int r = 0; r < order; ++r) {
      if (r == i) continue;
      const double f = m[r][i] / m[i][i];
      for (int c = i; c < 4; ++c) m[r][c] -= f * m[i][c];
    }
  }
  return {m[0][3] / m[0][0], order > 1 ? m[1][3] / m[1][1] / scale : 0};
}

}  // namespace gapscope
