// What closes on each log, fitted without it.
#ifndef GAPSCOPE_DIAGNOSE_GAP_BY_LOG_H_
#define GAPSCOPE_DIAGNOSE_GAP_BY_LOG_H_

#include <span>
#include <vector>

#include "src/diagnose/candidate.h"
#include "src/diagnose/diagnosis.h"

namespace gapscope {

// The sensors' noise as a normalised error. `noise`: by the experiment's signals, SI.
double FloorError(std::span<const Recording> logs, const std::vector<double>& noise);

// Of the held-out logs, or parts of logs, by both models as they are. Then, where `final` has effects and whole logs
// were held out, of the training logs: parts of them are left out in turn, the parameters fitted to all other logs from
// where they are (held-out ones that the user asked to keep are not fitted), and the errors are those of the logs left
// out. A log where a model cannot be simulated has an infinite error.
std::vector<LogGap> GapByLog(const Workbench& bench, const Candidate& base, const Candidate& final,
                             const std::vector<double>& noise);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_GAP_BY_LOG_H_
