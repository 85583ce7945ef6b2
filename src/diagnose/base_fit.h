// What a search begins with: the model as it is given, and refitted without any effect.
#ifndef GAPSCOPE_DIAGNOSE_BASE_FIT_H_
#define GAPSCOPE_DIAGNOSE_BASE_FIT_H_

#include <memory>

#include "src/diagnose/search.h"

namespace gapscope {

// The base model, refitted; nothing is searched yet. Errors: it cannot be simulated along the logs.
Result<std::unique_ptr<SearchResult>> FitBase(const Workbench& bench, const Say& say);

// Which joints touch, at a model, for all that is fitted from then on. Few joints, or one drive's, all touch.
void MeasureCoupling(const Workbench& bench, Candidate& at);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_BASE_FIT_H_
