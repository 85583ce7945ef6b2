// The diagnosis in words.
#ifndef GAPSCOPE_DIAGNOSE_EXPLAIN_H_
#define GAPSCOPE_DIAGNOSE_EXPLAIN_H_

#include "src/diagnose/diagnosis.h"

namespace gapscope {

// The verdict in a paragraph. `floors_before`, `floors_left`: residual over noise of the refitted base model and of the
// final one.
std::string Explain(const Diagnosis& diagnosis);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_EXPLAIN_H_
