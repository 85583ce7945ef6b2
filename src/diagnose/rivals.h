// What the logs do not tell from an effect that was found.
#ifndef GAPSCOPE_DIAGNOSE_RIVALS_H_
#define GAPSCOPE_DIAGNOSE_RIVALS_H_

#include "src/diagnose/judge.h"

namespace gapscope {

// Told together with a member of the final set, as likely: what costs as little in its place, what is one motion with
// it in these logs, and a richer effect that would not show beyond it. The first statements of `result` are the
// members', in their order. `anew`: the set is not the one that the search tried rivals in.
void TellRivals(const Workbench& bench, SearchResult& found, bool anew, const Say& say, Judgement* result);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_RIVALS_H_
