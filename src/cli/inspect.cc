#include <fmt/format.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "src/cli/commands.h"
#include "src/cli/print.h"
#include "src/cli/progress.h"
#include "src/cli/session.h"
#include "src/log/foreign.h"
#include "src/report/inspect_report.h"
#include "src/report/json.h"
#include "src/report/write_run.h"

namespace gapscope::cli {
namespace {

struct InspectFlags {
  CommonFlags common;
  ModelFlags model;
};

InspectReport InspectRecording(const Recording& recording, const Experiment& experiment) {
  std::vector<InspectChannel> channels;
  for (std::size_t c = 0; c < recording.commands.size(); ++c) {
    const auto& command = recording.commands[c];
    if (!command.column) continue;
    channels.push_back({.name = command.actuator,
                        .unit = experiment.commands[c].unit,
                        .role = ChannelRole::kCommand,
                        .values = command.values});
  }
  for (const auto& measured : recording.measured) {
    channels.push_back({.name = measured.spec.signal,
                        .unit = measured.spec.unit,
                        .role = ChannelRole::kMeasured,
                        .values = measured.values});
  }
  return Inspect(recording.timeline, channels, recording.findings, recording.rows_in_log);
}

// Which columns have which rate, by which stamps: a line for each.
std::vector<Finding> Rates(const Log& log, const Timeline& timeline) {
  std::map<std::string, std::vector<std::string>> columns;
  for (const Column& column : log.columns) {
    if (column.name == timeline.time_column) continue;
    std::vector<double> stamps;
    for (std::size_t k = 0; k < timeline.rows.size(); ++k) {
      if (std::isfinite(column.values[timeline.rows[k]])) stamps.push_back(timeline.time_s[k]);
    }
    const double span = stamps.empty() ? 0 : stamps.back() - stamps.front();
    const std::string rate =
        span > 0 ? fmt::format("{:.4g} Hz", static_cast<double>(stamps.size() - 1) / span) : "no rate";
    columns[rate + (column.clock.empty() ? "" : ", " + column.clock + " stamps")].push_back(column.name);
  }
  std::vector<Finding> findings;
  findings.reserve(columns.size());
  for (const auto& [rate, names] : columns)
    findings.push_back({"rate", "", names.size(), 0, fmt::format("{}: {}", rate, fmt::join(names, ", "))});
  return findings;
}

// A log that no experiment says anything of: all of its columns, in the log's own units.
Result<InspectReport> InspectAlone(const std::string& path) {
  GS_ASSIGN(const Log log, ReadLog(path, {}));
  GS_ASSIGN(const Timeline timeline, BuildTimeline(log, {}));
  std::vector<InspectChannel> channels;
  for (const Column& column : log.columns) {
    if (column.name == timeline.time_column) continue;
    InspectChannel channel{.name = column.name, .unit = column.unit, .role = ChannelRole::kMeasured, .values = {}};
    for (const std::size_t row : timeline.rows) channel.values.push_back(column.values[row]);
    channels.push_back(std::move(channel));
  }
  std::vector<Finding> findings = log.findings;
  findings.insert(findings.end(), timeline.findings.begin(), timeline.findings.end());
  for (Finding& rate : Rates(log, timeline)) findings.push_back(std::move(rate));
  InspectOptions options;
  if (log.joined) options.most_missing = 1;  // where another rate has a row
  InspectReport report = Inspect(timeline, channels, findings, log.rows(), options);
  report.verdict = {"an experiment file says which columns are commands: `gapscope init MODEL.xml LOG` drafts one"};
  return report;
}

Result<InspectRun> InspectBound(const InspectFlags& flags) {
  ThreadPool pool(WorkersOf(flags.common));
  GS_ASSIGN(Experiment experiment, LoadExperiment(flags.model.experiment));
  if (!flags.model.while_column.empty()) experiment.replay.while_column = flags.model.while_column;
  GS_ASSIGN(const auto recordings, LoadRecordings(experiment, flags.model.logs, pool));
  InspectRun run{.info = {}, .logs = std::vector<InspectRun::Log>(recordings.size())};
  pool.ForEach(recordings.size(), [&](std::size_t i, int) {
    run.logs[i] = {.log = recordings[i].log_path, .report = InspectRecording(recordings[i], experiment)};
  });
  return run;
}

Result<InspectRun> InspectUnbound(const std::vector<std::string>& logs) {
  InspectRun run;
  for (const std::string& log : logs) {
    GS_ASSIGN(InspectReport report, InspectAlone(log));
    run.logs.push_back({.log = log, .report = std::move(report)});
  }
  return run;
}

bool IsExperiment(const std::string& path) { return path.ends_with(".yaml") || path.ends_with(".yml"); }

Result<int> RunInspect(const InspectFlags& flags) {
  GS_ASSIGN(std::vector<std::string> all, LogsNamed(flags.model.experiment));  // or an experiment
  all.insert(all.end(), flags.model.logs.begin(), flags.model.logs.end());
  const bool bound = IsExperiment(flags.model.experiment);
  if (bound && flags.model.logs.empty())
    return Error{.what = "no log", .where = flags.model.experiment, .cure = "name the logs behind the experiment"};
  auto inspected = [&] {
    ProgressLine line(flags.common);
    ShowReading(all, &line);
    return bound ? InspectBound(flags) : InspectUnbound(all);
  }();
  GS_ASSIGN(const InspectRun run, std::move(inspected));
  const nlohmann::ordered_json json = ToJson(run);
  if (!flags.common.out.empty()) GS_RETURN_IF_ERROR(WriteRun(flags.common.out, json));
  Print(stdout, "{}", flags.common.json ? JsonText(json) : ToTable(run));
  return kDone;
}

}  // namespace

Command InspectCommand() {
  auto flags = std::make_shared<InspectFlags>();
  std::vector<Option> files = LogOptions(flags->model);
  files[0].help = "Experiment file (.yaml), or a log";
  files[0].more = "Without an experiment every column is looked at, in the log's own units";
  files[1].required = false;
  return {.name = "inspect",
          .what = "Is this log fit for use: timing, gaps, repairs, saturation, excitation",
          .options = Join({files, {FolderOption(flags->common, "result.json")}, CommonOptions(flags->common)}),
          .example = "gapscope inspect models/qube/experiment.yaml log.csv",
          .run = [flags] { return RunInspect(*flags); }};
}

}  // namespace gapscope::cli
