// NLopt's methods on a fit's cost (S. G. Johnson, The NLopt nonlinear-optimization package,
// https://nlopt.readthedocs.io). They see F(y) = min over the windows' states of cost(y, x), whose value and gradient
// the normal equations give (variable projection).
//
// The local methods get coordinates z in which the Gauss-Newton Hessian at the best point so far is the identity:
// y = y0 + L^-T z with hessian = L L', cost over the cost there. Parameters of a mechanism act nearly alike in pairs,
// and a quasi-Newton method that must learn that from gradients takes many times as long. A coordinate that would leave
// its bounds stays on them. Rounds of this, each with the Hessian of the last one's best point, end when one gains
// nothing.
#ifndef GAPSCOPE_FIT_NLOPT_H_
#define GAPSCOPE_FIT_NLOPT_H_

#include "src/fit/optimizers.h"

namespace gapscope {

// A local method from the start.
SolveResult SolveWithNlopt(const SolveTask& task, const FitPoint& start, const SolveOptions& options,
                           const OptimizerRow& row);

// A global method inside the bounds, then slsqp from the best that it found. options.max_iterations counts hundreds of
// evaluations.
SolveResult SearchWithNlopt(const SolveTask& task, const FitPoint& start, const SolveOptions& options,
                            const OptimizerRow& row);

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_NLOPT_H_
