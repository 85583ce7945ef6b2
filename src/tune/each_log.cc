#include "src/tune/each_log.h"

namespace gapscope {

LogFits FitEachLog(const Model& model, const std::vector<Recording>& logs, const TuneSummary& joint,
                   const TuneOptions& options, ThreadPool& pool) {
  TuneOptions alone = options;
  alone.free.clear();
  for (const TunedParameter& tuned : joint.tuned) {
    if (tuned.identifiable) alone.free.push_back(tuned.index);
  }
  if (alone.free.empty()) return {.warnings = {"no log is fitted alone: all of them together know no parameter"}};
  alone.if_known.clear();
  alone.starts = 1;
  alone.time_step_s = joint.time_step_s;
  alone.journal.clear();
  LogFits fits;
  for (const Recording& log : logs) {
    if (IsLate(alone.solve.deadline)) break;
    auto fit = Tune(model, {.train = {log}}, joint.values, alone, pool);
    if (fit.ok()) {
      fits.logs.push_back({log.log_path, fit.value().termination, std::move(fit.value().tuned)});
    } else {
      fits.warnings.push_back(log.log_path + " is not fitted alone: " + fit.error().Text());
    }
  }
  // The last fit was cut short.
  if (IsLate(alone.solve.deadline))
    return {.warnings = {"time was up before each log was fitted alone: the result is of all logs together"}};
  return fits;
}

}  // namespace gapscope
