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
};
struct LogFits {
  std::vector<LogFit> logs;           // in the order of the logs; empty: time was up before the last one
  std::vector<std::string> warnings;  // why a log is not there
};

// `joint`: what Tune found of all `logs` with these options. Each fit starts there, once, without a journal; what the
// joint fit does not know stays as it is.
LogFits FitEachLog(const Model& model, const std::vector<Recording>& logs, const TuneSummary& joint,
                   const TuneOptions& options, ThreadPool& pool);

}  // namespace gapscope

#endif  // GAPSCOPE_TUNE_EACH_LOG_H_
