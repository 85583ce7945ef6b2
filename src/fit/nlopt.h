// NLopt's methods on a fit's cost (S. G. Johnson, The NLopt nonlinear-optimization package,
// https://nlopt.readthedocs.io). They see F(y) = min over the windows' states of cost(y, x), whose value and gradient
// the normal equations give (variable projection).
//
// The local methods run in rounds. A round makes one Jacobian where it begins; an evaluation then is a replay or a few,
// with Broyden's update of the Jacobian. Its coordinates make the damped Gauss-Newton Hessian there the identity,
// bounds put into a smooth map: parameters of a mechanism act nearly alike in pairs, and a quasi-Newton method that
// must learn that from gradients takes many times as long. The damping grows after a round that gains hardly anything;
// several of them end the run.
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
