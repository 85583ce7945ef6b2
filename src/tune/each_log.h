// The parameters that a fit of many logs knows, fitted to each of the logs alone: how they differ from log to log.
#ifndef GAPSCOPE_TUNE_EACH_LOG_H_
#define GAPSCOPE_TUNE_EACH_LOG_H_

#include <string>
#include <vector>

#include "src/tune/tune.h"

namespace gapscope {

struct LogFit {
  std::string log;
  Termination termination = Termination::kConverged;
  std::vector<TunedParameter> tuned;
  Spread spread;  // of `tuned`
};
struct LogFits {
  std::vector<LogFit> logs;           // in the order of the logs; empty: time was up before the last one
  std::vector<std::string> warnings;  // why a log is not there
};

// `joint`: what Tune found of all `logs` with these options. Each fit starts there, once, with a journal of its own
// beside the joint fit's; what the joint fit does not know stays as it is.
// A later run with TuneOptions::resume goes on from these fits' journals.
LogFits FitEachLog(const Model& model, const std::vector<Recording>& logs, const TuneSummary& joint,
                   const TuneOptions& options, ThreadPool& pool);
// Removes the journals of such fits to the first `logs` logs: before a run that does not go on from them.
void ForgetLogFits(const TuneOptions& options, std::size_t logs);

}  // namespace gapscope

#endif  // GAPSCOPE_TUNE_EACH_LOG_H_
