// Effects that were looked at and did not enter the final set.
#ifndef GAPSCOPE_DIAGNOSE_OTHERS_H_
#define GAPSCOPE_DIAGNOSE_OTHERS_H_

#include "src/diagnose/judge.h"

namespace gapscope {

// Adds a statement for each that `result` has none of: absent, or unseen and why.
void TellOthers(const Workbench& bench, const SearchResult& found, Judgement* result);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_OTHERS_H_
