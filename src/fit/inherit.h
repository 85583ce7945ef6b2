// What a fit knows of another one's Jacobian: a model that an effect is added to, or taken from, moves nearly as
// before.
#ifndef GAPSCOPE_FIT_INHERIT_H_
#define GAPSCOPE_FIT_INHERIT_H_

#include "src/fit/fit_problem.h"

namespace gapscope {

// Derivatives of `to` at `point` with the columns of `known`, which are those of `from`, where the two problems have a
// coordinate or a state in common; the others are differenced, and the residuals are those of the point. Both are of
// the same logs and windows. The columns are those of another point and another model: good for steps that are tried,
// not for the bottom.
Derivatives Inherit(const FitProblem& from, const Derivatives& known, FitProblem& to, const FitPoint& point,
                    double step);

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_INHERIT_H_
