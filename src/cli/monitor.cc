// New logs against a finished tune or diagnosis: its model on both, log by log, and its parameters fitted to both.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "src/cli/commands.h"
#include "src/cli/html.h"
#include "src/cli/print.h"
#include "src/cli/result_model.h"
#include "src/cli/session.h"
#include "src/compare/noise.h"
#include "src/core/change_point.h"
#include "src/core/collect.h"
#include "src/log/foreign.h"
#include "src/report/json.h"
#include "src/report/read_diagnosis.h"
#include "src/report/read_json.h"
#include "src/report/read_run.h"
#include "src/report/robot_changes.h"

namespace gapscope::cli {
namespace {

using nlohmann::ordered_json;

struct MonitorFlags {
  CommonFlags common;
  ResultSource source;
  std::vector<std::string> logs;
  double fail_above = 0;
  bool fail_on_change = false;
};

// What one log says of the result's model.
struct LogFindings {
  double error = kNaN;                // of the result's model as it is
  double misfit = kNaN, left = kNaN;  // over the sensors' noise: of that, and with the parameters fitted to this log
  std::vector<SeriesValue> sizes;     // refitted; a value of NaN: this log does not know it
  std::vector<std::string> problems;  // why it could not be refitted
};

struct Moved {
  std::string name, unit;
  ChangePoint step;  // its chance is over all parameters
};

struct MonitorRun {
  std::vector<std::string> before, now;  // logs
  double error_before = kNaN, error_now = kNaN;
  std::vector<Moved> parameters;  // the least likely to be chance first
  // Over the sensors' noise: of the result's model as it is, and with its parameters fitted to each log alone.
  std::optional<ChangePoint> misfit, left;
  std::vector<std::string> problems;
  std::string diagnosis;  // the command that names what the result lacks

  double Ratio() const { return error_now / error_before; }
  bool Changed() const {
    return (!parameters.empty() && parameters.front().step.chance <= kFalseChange) || Grown(misfit) || Grown(left);
  }

  // Null where it did not grow.
  static const ChangePoint* Grown(const std::optional<ChangePoint>& step) {
    return step && step->after > step->before && step->chance <= kFalseChange ? &*step : nullptr;
  }
};

// The logs that a result was made of, and of these the ones it was judged by.
struct ResultLogs {
  std::vector<std::string> all, held_out;
};

Result<ResultLogs> LogsOf(const ordered_json& json, const std::string& where) {
  ResultLogs logs;
  const auto add = [&](const std::string& path, bool held_out) {
    if (held_out) logs.held_out.push_back(path);
    if (std::find(logs.all.begin(), logs.all.end(), path) == logs.all.end()) logs.all.push_back(path);
  };
  if (TextIn(json, "schema") == kTuneSchema) {
    GS_ASSIGN(const TuneRun run, ReadTuneRun(json, where));
    for (const auto& log : run.train) add(log.log, false);
    for (const auto& log : run.held_out) add(log.log, true);
  } else {
    GS_ASSIGN(const EarlierDiagnosis earlier, ReadDiagnosis(json, where));
    for (const auto& log : earlier.train_logs) add(log, false);
    for (const auto& log : earlier.held_out_logs) add(log, true);
  }
  for (const auto& log : logs.all) {
    std::error_code failure;
    if (!std::filesystem::exists(log, failure))
      return Error{.what = "a log of the result is not there: new logs are compared with it",
                   .where = where,
                   .actual = log,
                   .cure = "go to the folder where the result was made, or put the log back"};
  }
  return logs;
}

// Root mean square of residual over noise, all scored signals alike. `noise`: of each signal.
double OverNoise(const LogReplay& log, const std::vector<double>& noise) {
  double sum = 0;
  int signals = 0;
  for (std::size_t s = 0; s < log.signals.size(); ++s) {
    const double square = MeanSquareError(log.signals[s]);
    if (!log.signals[s].scored || std::isnan(square) || !(noise[s] > 0)) continue;
    sum += square / (noise[s] * noise[s]);
    ++signals;
  }
  return signals > 0 ? std::sqrt(sum / signals) : kNaN;
}

LogFindings Look(const ResultModel& result, Recording recording, const CommonFlags& common, ThreadPool& pool) {
  const ReplayDefaults& replay = result.model->rig()->experiment().replay;
  const TuneOptions options = DefaultTuneOptions(replay, 1, common.seed);
  LogFindings found{.sizes = std::vector<SeriesValue>(result.model->parameters().size(), {.value = kNaN})};
  const auto noise = Collect(recording.measured, [&](const Recording::Measured& signal) {
    return SensorNoise(recording.time_s, signal.values, signal.spec.resolution);
  });
  std::vector<Recording> one;
  one.push_back(std::move(recording));
  const auto as_it_is = Evaluate(*result.model, one, {result.values, std::nullopt}, replay.mode, options, pool);
  found.error = ReplayError(as_it_is);
  found.misfit = OverNoise(as_it_is.front(), noise);
  const auto tuned = Tune(*result.model, SplitData(std::move(one), {}), result.values, options, pool);
  if (!tuned.ok()) {
    found.problems.push_back(tuned.error().Text());
    return found;
  }
  found.left = OverNoise(tuned.value().train.front(), noise);
  for (const TunedParameter& p : tuned.value().tuned) {
    if (p.identifiable)
      found.sizes[static_cast<std::size_t>(p.index)] = {p.value, (p.high - p.low) / (2 * kNormalQuantile)};
  }
  return found;
}

// The series of a number over all logs, those before first; none where one side does not know it.
std::optional<ChangePoint> StepOf(const std::vector<SeriesValue>& before, const std::vector<SeriesValue>& now) {
  std::vector<SeriesValue> series;
  const auto add = [&](const SeriesValue& value) {
    if (std::isfinite(value.value)) series.push_back(value);
  };
  for (const auto& value : before) add(value);
  const std::size_t first = series.size();
  for (const auto& value : now) add(value);
  if (first == 0 || first == series.size()) return std::nullopt;
  // Of two values nothing but their own errors says how much they may differ.
  if (series.size() == 2 && !(series[0].error > 0 && series[1].error > 0)) return std::nullopt;
  return StepAt(series, first);
}

// A misfit changes by a factor: its logarithm is what varies alike at any size.
std::optional<ChangePoint> StepOfMisfit(double LogFindings::* misfit, const std::vector<LogFindings>& before,
                                        const std::vector<LogFindings>& now) {
  const auto logs = [&](const std::vector<LogFindings>& side) {
    return Collect(side, [&](const LogFindings& log) { return SeriesValue{.value = std::log(log.*misfit)}; });
  };
  std::optional<ChangePoint> step = StepOf(logs(before), logs(now));
  if (step) step->before = std::exp(step->before), step->after = std::exp(step->after);
  return step;
}

// The parameters that both sides know.
std::vector<Moved> Compared(const Model& model, const std::vector<LogFindings>& before,
                            const std::vector<LogFindings>& now) {
  std::vector<Moved> all;
  for (std::size_t p = 0; p < model.parameters().size(); ++p) {
    const auto sizes = [&](const std::vector<LogFindings>& side) {
      return Collect(side, [&](const LogFindings& log) { return log.sizes[p]; });
    };
    if (const auto step = StepOf(sizes(before), sizes(now)))
      all.push_back({model.parameters()[p].name, model.parameters()[p].unit, *step});
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Moved& a, const Moved& b) { return a.step.chance < b.step.chance; });
  return all;
}

// With the result's effects at its values, on the new logs.
std::string DiagnosisOfWhatIsLeft(const Experiment& experiment, const Model& model, const MonitorFlags& flags) {
  std::string command = "gapscope diagnose " + ShellQuoted(experiment.path);
  for (const auto& log : flags.logs) command += " " + ShellQuoted(log);
  for (const auto& use : model.effects()) command += " --with " + use.Text();
  return command + " --params " + ShellQuoted(flags.source.path);
}

Result<MonitorRun> Monitor(const MonitorFlags& flags) {
  GS_ASSIGN(const ordered_json json, ReadJson(flags.source.path));
  GS_ASSIGN(const RunModel held, ReadRunModel(json, flags.source.path));
  GS_ASSIGN(const ResultLogs logs, LogsOf(json, flags.source.path));
  GS_ASSIGN(Experiment experiment, ExperimentOf(flags.source, held));
  if (!flags.source.while_column.empty()) experiment.replay.while_column = flags.source.while_column;
  ThreadPool pool(WorkersOf(flags.common));
  GS_ASSIGN(std::vector<Recording> old_ones, LoadRecordings(experiment, logs.all, pool));
  GS_ASSIGN(std::vector<Recording> new_ones, LoadRecordings(experiment, flags.logs, pool));
  PrintFindings(new_ones, flags.common.quiet);
  GS_ASSIGN(const std::shared_ptr<const Rig> rig, Rig::Load(experiment));
  GS_ASSIGN(const auto bare, Model::Build(rig));
  GS_ASSIGN(const ResultModel result, BuildRunModel(rig, held, flags.source.path, EstimateScales(*bare, old_ones)));
  MonitorRun run{.before = logs.all, .now = flags.logs};
  std::vector<LogFindings> before, now;
  std::vector<double> errors_before, errors_now;
  for (std::size_t i = 0; i < old_ones.size(); ++i) {
    before.push_back(Look(result, std::move(old_ones[i]), flags.common, pool));
    // What was fitted to a log is too good a judge of it.
    if (std::find(logs.held_out.begin(), logs.held_out.end(), logs.all[i]) != logs.held_out.end())
      errors_before.push_back(before.back().error);
  }
  for (Recording& recording : new_ones) {
    now.push_back(Look(result, std::move(recording), flags.common, pool));
    errors_now.push_back(now.back().error);
    for (const auto& problem : now.back().problems) run.problems.push_back(problem);
  }
  run.error_before = Median(errors_before);
  run.error_now = Median(errors_now);
  run.parameters = Compared(*result.model, before, now);
  run.misfit = StepOfMisfit(&LogFindings::misfit, before, now);
  run.left = StepOfMisfit(&LogFindings::left, before, now);
  // Any of these numbers may step by chance.
  const auto numbers = static_cast<double>(run.parameters.size() + (run.misfit ? 1 : 0) + (run.left ? 1 : 0));
  const auto over_all = [&](ChangePoint& step) { step.chance = std::min(1.0, numbers * step.chance); };
  for (Moved& one : run.parameters) over_all(one.step);
  if (run.misfit) over_all(*run.misfit);
  if (run.left) over_all(*run.left);
  run.diagnosis = DiagnosisOfWhatIsLeft(experiment, *result.model, flags);
  return run;
}

ordered_json StepJson(const std::optional<ChangePoint>& step) {
  if (!step) return nullptr;
  return {{"before", JsonNumber(step->before)}, {"now", JsonNumber(step->after)}, {"chance", JsonNumber(step->chance)}};
}

ordered_json ToJson(const MonitorRun& run) {
  ordered_json json = {{"schema", "gapscope.monitor/1"},
                       {"changed", run.Changed()},
                       {"error", {{"before", JsonNumber(run.error_before)}, {"now", JsonNumber(run.error_now)}}},
                       {"misfit", StepJson(run.misfit)},
                       {"left", StepJson(run.left)},
                       {"parameters", ordered_json::array()},
                       {"logs", {{"before", run.before}, {"now", run.now}}},
                       {"problems", run.problems},
                       {"versions", JsonVersions()}};
  if (MonitorRun::Grown(run.left)) json["left"]["diagnosis"] = run.diagnosis;
  for (const auto& [name, unit, step] : run.parameters) {
    ordered_json one = {{"name", name}, {"unit", unit}};
    one.update(StepJson(step));
    json["parameters"].push_back(std::move(one));
  }
  return json;
}

std::string ToTable(const MonitorRun& run) {
  std::string table =
      fmt::format("error: {:.4g} now, {:.4g} before: {:.3g} times\n", run.error_now, run.error_before, run.Ratio());
  for (const auto& problem : run.problems) table += "not refitted: " + problem + "\n";
  if (!run.Changed())
    return table + fmt::format("the same as before, as far as {} logs of the result and {} new ones can tell\n",
                               run.before.size(), run.now.size());
  if (const ChangePoint* misfit = MonitorRun::Grown(run.misfit))
    table += fmt::format(
        "changed: the result's model misses by {:.3g} times the sensors' noise, {:.3g} before (chance "
        "{:.1g})\n",
        misfit->after, misfit->before, misfit->chance);
  for (const auto& [name, unit, step] : run.parameters) {
    if (step.chance <= kFalseChange)
      table += fmt::format("changed: {} from {:.4g} to {:.4g} {} (chance {:.1g})\n", name, step.before, step.after,
                           unit, step.chance);
  }
  if (const ChangePoint* left = MonitorRun::Grown(run.left))
    table += fmt::format(
        "changed: what no parameter of it follows, {:.3g} times the noise, {:.3g} before (chance "
        "{:.1g}): the logs may hold an effect that it lacks\n  {}\n",
        left->after, left->before, left->chance, run.diagnosis);
  return table;
}

Result<int> RunMonitor(const MonitorFlags& flags) {
  GS_ASSIGN(const MonitorRun run, Monitor(flags));
  Print(stdout, "{}", flags.common.json ? JsonText(ToJson(run)) : ToTable(run));
  if (flags.fail_above > 0 && !(run.Ratio() <= flags.fail_above)) {
    if (!flags.common.quiet)
      Print(stderr, "gapscope: {:.3g} times the error is above --fail-above {:.4g}\n", run.Ratio(), flags.fail_above);
    return kBelowThreshold;
  }
  return flags.fail_on_change && run.Changed() ? kBelowThreshold : kDone;
}

}  // namespace

Command MonitorCommand() {
  auto flags = std::make_shared<MonitorFlags>();
  const std::vector<Option> own = {
      {.flag = "result",
       .value = &flags->source.path,
       .required = true,
       .help = "Folder of a finished tune or diagnosis",
       .more = "Its logs must still be there: new ones are compared with them, log by log"},
      {.flag = "logs", .value = &flags->logs, .stands_for = LogsNamed, .required = true, .help = "New hardware logs"},
      {.flag = "--experiment",
       .value = &flags->source.experiment,
       .unset = "the one that the result names",
       .help = "Experiment file of the result"},
      WhileOption(flags->source.while_column),
      {.flag = "--fail-above",
       .value = &flags->fail_above,
       .range = Above(0, 0),
       .unset = "never",
       .help = "Exit status 1 where the error is more than this many times the result's on its held-out logs"},
      {.flag = "--fail-on-change",
       .value = &flags->fail_on_change,
       .help = "Exit status 1 where a parameter has changed, or the misfit has grown",
       .more =
           fmt::format("Changed: the step between the result's logs and the new ones would be chance, in any of these "
                       "numbers, in at most {} of 1",
                       kFalseChange)}};
  return {.name = "monitor",
          .what = "A new log against a finished result: the same as before, or what changed",
          .options = Join({own, CommonOptions(flags->common)}),
          .example = "gapscope monitor diagnosis today.csv --fail-above 1.5",
          .run = [flags] { return RunMonitor(*flags); }};
}

}  // namespace gapscope::cli
