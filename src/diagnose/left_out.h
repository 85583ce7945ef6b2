// What closes on each log, fitted without it, and how far the sizes move by that.
#ifndef GAPSCOPE_DIAGNOSE_LEFT_OUT_H_
#define GAPSCOPE_DIAGNOSE_LEFT_OUT_H_

#include <span>
#include <vector>

#include "src/diagnose/candidate.h"
#include "src/diagnose/diagnosis.h"

namespace gapscope {

// What the sensors' noise is of the normalised error, of no signal more than its error; all of it where a log was not
// simulated (`errors` is empty). `noise`: by the experiment's signals, SI.
double FloorError(std::span<const Recording> logs, std::span<const BlockErrors::value_type> errors,
                  const std::vector<double>& noise);

struct LeftOut {
  std::vector<LogGap> gaps;
  // Of the final model's parameters: each time fitted without another part of what was fitted.
  std::vector<std::vector<double>> values;
};

// Gaps of the held-out logs, or parts of logs, by both models as they are. Then, where `final` has effects, parts of
// the training logs are left out in turn, and the parameters fitted to all other logs from where they are (held-out
// ones that the user asked to keep are not fitted). The errors on those that are left out make gaps too. Where windows
// of every log are held out, since only some logs show the gap, parts of the training windows are left out, for the
// values alone. A log where a model cannot be simulated has an infinite error.
LeftOut LeaveOut(const Workbench& bench, const Candidate& base, const Candidate& final,
                 const std::vector<double>& noise);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_LEFT_OUT_H_
