#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "src/cli/commands.h"
#include "src/cli/session.h"
#include "src/report/inspect_report.h"
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

Result<int> RunInspect(const InspectFlags& flags) {
  ThreadPool pool(flags.common.jobs > 0 ? flags.common.jobs : DefaultWorkers());
  GS_ASSIGN(Experiment experiment, LoadExperiment(flags.model.experiment));
  if (!flags.model.while_column.empty()) experiment.replay.while_column = flags.model.while_column;
  GS_ASSIGN(const auto recordings, LoadRecordings(experiment, flags.model.logs, pool));
  InspectRun run{.info = {}, .logs = std::vector<InspectRun::Log>(recordings.size())};
  pool.ForEach(recordings.size(), [&](std::size_t i, int) {
    run.logs[i] = {.log = recordings[i].log_path, .report = InspectRecording(recordings[i], experiment)};
  });
  const nlohmann::ordered_json json = ToJson(run);
  if (!flags.common.out.empty()) GS_RETURN_IF_ERROR(WriteRun(flags.common.out, json));
  fmt::print("{}", flags.common.json ? json.dump(2) + "\n" : ToTable(run));
  return kDone;
}

}  // namespace

Command InspectCommand() {
  auto flags = std::make_shared<InspectFlags>();
  return {.name = "inspect",
          .what = "Is this log fit for use: timing, gaps, repairs, saturation, excitation",
          .options = Join(
              {LogOptions(flags->model), {FolderOption(flags->common, "result.json")}, CommonOptions(flags->common)}),
          .example = "gapscope inspect models/qube/experiment.yaml log.csv",
          .run = [flags] { return RunInspect(*flags); }};
}

}  // namespace gapscope::cli
