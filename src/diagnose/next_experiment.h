// What a diagnosis leaves open, and the experiment that would settle it: of a library of inputs within the rig's limits
// the one on which the explanations that are left differ most (src/design/optimal.h), and what the probability of the
// first of them would be after it.
#ifndef GAPSCOPE_DIAGNOSE_NEXT_EXPERIMENT_H_
#define GAPSCOPE_DIAGNOSE_NEXT_EXPERIMENT_H_

#include <functional>
#include <optional>

#include "src/diagnose/judge.h"

namespace gapscope {

// What is asked of a further log.
struct OpenQuestion {
  NextExperiment next;  // without its input
  // The second explanation lacks the first one's effect, and has no other one for it: `numbers` are the effect's. Else
  // one of the explanations is there, with `together` as its probability, and they stand in for each other: by these
  // logs the second one costs `behind` more, and is told with the first one up to `tie`.
  StatementNumbers numbers;
  bool nested = false;
  double together = 0, behind = 0, tie = 0;
  double seconds = 0;    // of these logs
  double remaining = 1;  // squared residual over the sensors' noise that the likeliest one leaves
};

// The next question, which is fitted for only when it is asked; nothing: there are no more.
using AskNext = std::function<std::optional<OpenQuestion>()>;
// One question of each kind, the one most worth an experiment first: effects that are told together; one that is not
// sure; one that a single log shows; one that these logs cannot show. Of several the largest gain's. All that is given
// must outlive it.
AskNext OpenQuestions(const Workbench& bench, SearchResult& found, const Judgement& judgement);

// An input's length, and the squared residuals that the second explanation leaves where the first one holds (`there`)
// and the other way round, both over what the likeliest one leaves of these logs.
struct ForetoldMisfit {
  double seconds = 0, there = 0, not_there = 0;
};
// The first explanation's probability in a diagnosis of the old logs and the new one, if it holds and if it does not.
struct Foretold {
  double if_present = 0, if_absent = 0;
};
Foretold Foretell(const OpenQuestion& question, const ForetoldMisfit& misfit);
// Whether the two answers would tell the question, or tell one of several explanations alone where it is there.
bool IsWorthALog(const OpenQuestion& question, const Foretold& foretold);

// The first question that an input of the library would settle, with that input; else the first one, and why there is
// none. `noise`: of each measured signal, SI. Limits that the experiment does not state are what the logs reached.
NextExperiment DesignNext(const AskNext& ask, const Workbench& bench, const std::vector<double>& noise);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_NEXT_EXPERIMENT_H_
