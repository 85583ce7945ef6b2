// A replay for people and programs: console table, JSON (gapscope.replay/1), traces as CSV.
#ifndef GAPSCOPE_REPORT_REPLAY_REPORT_H_
#define GAPSCOPE_REPORT_REPLAY_REPORT_H_

#include <cstdint>
#include <limits>
#include <span>
#include <string>

#include "src/compare/comparison.h"
#include "src/report/console.h"

namespace gapscope {

struct ReplayReport {
  const ReplayResult& result;
  const Comparison& comparison;
  const Model& model;
  std::span<const double> values;  // of the model's parameters
  std::uint64_t seed = 0;
  double other_error = 0;  // of a free run where the replay was in windows, in windows where it was a free run
  double nominal_error =
      std::numeric_limits<double>::quiet_NaN();  // of the nominal model, where this one has effects or other values
};

// At most 100 columns.
std::string ReplayTable(const ReplayReport& report, const Console& console = {});
std::string ReplayJson(const ReplayReport& report);

// One CSV per log in `folder`, for PlotJuggler: __time, command/ACTUATOR, measured/SIGNAL, predicted/SIGNAL. Logs of
// the same file name get their position in front.
Status WriteTraces(const std::string& folder, const ReplayResult& result, const std::vector<Recording>& recordings);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_REPLAY_REPORT_H_
