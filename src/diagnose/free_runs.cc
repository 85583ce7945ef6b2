#include "src/diagnose/free_runs.h"

#include <algorithm>

#include "replay/replay.h"

namespace gapscope {
namespace {

// The rows of a recording that a run goes over.
Window RowsOf(const Recording& recording, const FreeRun& run) {
  const auto row = [&](double since_s) {
    constexpr double kSlack_s = 1e-9;
    const auto& t = recording.time_s;
    return static_cast<std::size_t>(std::lower_bound(t.begin(), t.end(), since_s - recording.start_s - kSlack_s) -
                                    t.begin());
  };
  return {row(run.from_s), std::min(row(run.until_s) + 1, recording.rows())};
}

double ErrorOn(const Recording& recording, const Model& model, const std::vector<double>& values, double time_step_s,
               const FreeRun& run) {
  Simulator simulator(model, time_step_s);
  simulator.set_stamps({.commands_s = run.commands_late_s});
  if (!simulator.SetParameters(values, recording)) return kInfinity;
  const Window rows = RowsOf(recording, run);
  LogReplay replay = EmptyTraces(recording);
  std::vector<double> predicted(rows.rows() * replay.signals.size());
  if (simulator.Run(recording, rows, run.start, predicted).outcome != Outcome::kCompleted) return kInfinity;
  for (std::size_t s = 0; s < replay.signals.size(); ++s) {
    for (std::size_t r = 0; r < rows.rows(); ++r)
      replay.signals[s].predicted[rows.begin + r] = predicted[r * replay.signals.size() + s] + run.offsets[s].second;
  }
  return ReplayError({replay});
}

}  // namespace

void ScoreOnEveryRow(const Model& model, const std::vector<double>& values, std::span<const Recording* const> logs,
                     double time_step_s, std::vector<FreeRun>* runs) {
  for (FreeRun& run : *runs) {
    const auto log = std::find_if(logs.begin(), logs.end(), [&](const Recording* recording) {
      return recording->log_path == run.log && recording->start_s <= run.from_s &&
             run.until_s <= recording->start_s + recording->time_s.back();
    });
    run.error = log == logs.end() ? kInfinity : ErrorOn(**log, model, values, time_step_s, run);
  }
}

}  // namespace gapscope
