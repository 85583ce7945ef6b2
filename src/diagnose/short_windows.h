// Where the base model leaves a log within a window, its slopes do not say what would bring it back. In shorter windows
// they do, but what explains those need not explain more: so a search there only hands on what it ends at.
#ifndef GAPSCOPE_DIAGNOSE_SHORT_WINDOWS_H_
#define GAPSCOPE_DIAGNOSE_SHORT_WINDOWS_H_

#include <vector>

#include "src/diagnose/search.h"

namespace gapscope {

struct ShortSearch {
  std::vector<Hint> hints;  // empty: the base model stays with the logs, or windows cannot be shorter
  Work work;                // beside the budget of `bench`
};
// `base`: refitted in the windows of `bench`. Errors: as FitBase.
Result<ShortSearch> SearchShortWindows(const Workbench& bench, const Candidate& base, const Say& say);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_SHORT_WINDOWS_H_
