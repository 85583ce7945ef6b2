// A replay's result for people and programs: console table, JSON (gapscope.replay/1).
#ifndef GAPSCOPE_REPORT_REPLAY_REPORT_H_
#define GAPSCOPE_REPORT_REPLAY_REPORT_H_

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "src/compare/comparison.h"
#include "src/core/statistics.h"
#include "src/report/closed_loop_report.h"
#include "src/report/console.h"
#include "src/report/json.h"
#include "src/report/run.h"

namespace gapscope {

struct ReplayRun {
  RunInfo info;
  ReplayResult result;    // the traces
  Comparison comparison;  // their scores, log by log
  RunModel model;
  std::vector<std::pair<std::string, double>> parameters;  // of the model, without the rig's own sizes
  double other_error = 0;       // of a free run where the replay was in windows, in windows where it was a free run
  double nominal_error = kNaN;  // of the nominal model, where this one has effects or other values
  std::optional<LoopStatistics> loop;  // of a replay with the loop closed
};
// The parts that come from the model. `values` as model.Nominal().
ReplayRun ReplayRunOf(const Model& model, std::span<const double> values, ReplayResult result, Comparison comparison);

inline constexpr const char* kReplaySchema = "gapscope.replay/1";
nlohmann::ordered_json ToJson(const ReplayRun& run, Timing timing = Timing::kInclude);
// At most 100 columns.
std::string ToTable(const ReplayRun& run, const Console& console = {});

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_REPLAY_REPORT_H_
