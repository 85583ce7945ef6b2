// Levenberg-Marquardt on the normal equations (Marquardt, "An algorithm for least-squares estimation of nonlinear
// parameters", SIAM J. 11, 1963), with bounds by an active set, secant steps between Jacobians and bent steps along
// curved valleys.
#ifndef GAPSCOPE_FIT_LM_H_
#define GAPSCOPE_FIT_LM_H_

#include "src/fit/optimizers.h"

namespace gapscope {

// Records its state in the journal once an iteration, and goes on from there.
SolveResult SolveLm(const SolveTask& task, const FitPoint& start, const SolveOptions& options, const OptimizerRow& row);

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_LM_H_
