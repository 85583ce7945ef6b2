// Held-out logs in one run each, and where these began: what others need to see the same error.
#ifndef GAPSCOPE_DIAGNOSE_FREE_RUNS_H_
#define GAPSCOPE_DIAGNOSE_FREE_RUNS_H_

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "replay/initial_state.h"
#include "src/core/statistics.h"

namespace gapscope {

struct FreeRun {
  std::string log;
  double from_s = 0, until_s = 0;  // since the log's first row
  InitialState start;              // of the final model's joints, in their order
  double commands_late_s = 0;      // how much later than their stamps commands act, beside the model's own delay
  std::vector<std::pair<std::string, double>> offsets;  // by signal: what the log says beyond the prediction
  double error = kInfinity;                             // normalised, on every row of the log
};

struct FreeRuns {
  double error = kInfinity;  // normalised (see ReplayError); infinity: it diverges
  std::vector<FreeRun> runs;
};

// Fills their errors: fits leave rows out of logs that have many.
void ScoreOnEveryRow(const Model& model, const std::vector<double>& values, std::span<const Recording* const> logs,
                     double time_step_s, std::vector<FreeRun>* runs);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_FREE_RUNS_H_
