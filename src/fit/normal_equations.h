// Normal equations of a fit with the windows' states eliminated, and the steps made with them.
//
// Windows are independent given y, so each window's state is eliminated from the normal equations by its own small
// Schur complement (Golub and Pereyra, "The differentiation of pseudo-inverses and nonlinear least squares problems
// whose variables separate", SIAM J. Numer. Anal. 10, 1973; Triggs et al., "Bundle adjustment", 2000, sec. 6).
#ifndef GAPSCOPE_FIT_NORMAL_EQUATIONS_H_
#define GAPSCOPE_FIT_NORMAL_EQUATIONS_H_

#include <utility>
#include <vector>

#include "src/fit/fit_problem.h"

namespace gapscope {

// Normal equations at a point with the window states eliminated.
struct Linearization {
  double cost = 0;
  double reduced_cost = 0;   // with the states at their own optimum, as far as the equations see it
  Eigen::MatrixXd hessian;   // Gauss-Newton, of y
  Eigen::VectorXd gradient;  // of y, at the states' own optimum
  // Reduced, per half second of a log and limb (Coupling), all windows there together: for cluster-robust covariances.
  // Limbs do not touch, so that what a model gets wrong of one says nothing of another.
  std::vector<Eigen::VectorXd> block_gradients;
  std::vector<int> block_series;            // the log and limb of each block; its blocks stand in the order of time
  std::vector<Eigen::MatrixXd> state_gain;  // dx_w = state_step - state_gain dy
  std::vector<Eigen::VectorXd> state_step;
  bool valid = false;  // false: the point cannot be simulated
  Work work;
};

// Whether the gradient is made once more in blocks of time.
enum class Blocks { kNone, kHalfSeconds };

// One window's part.
struct WindowEquations {
  double cost = 0, state_gain_cost = 0;  // state_gain_cost: what its own best state still gains
  Eigen::MatrixXd hessian, gain;
  Eigen::VectorXd gradient, state_step;
};
// `residual` and `jacobian` (y, then the state) with robust weights in them; `prior`: weights of the state. `cost` is
// left out.
WindowEquations ReduceWindow(const Eigen::VectorXd& residual, const Eigen::MatrixXd& jacobian,
                             const Eigen::VectorXd& state, const Eigen::VectorXd& prior);

Linearization Reduce(const FitProblem& problem, const FitPoint& point, const Derivatives& derivatives, Blocks blocks);

// Differentiate and Reduce; blocks with central differences, which are those of a final covariance.
Linearization Linearize(FitProblem& problem, const FitPoint& point, const DifferenceOptions& options);

// Moves y by dy, inside the bounds, and each window's state by its own best answer to that.
FitPoint Move(const FitProblem& problem, const FitPoint& point, const Linearization& at, const Eigen::VectorXd& dy);

// Moves derivatives at `from` to `to`, whose residuals are known, without a replay: Broyden's rank-one update of each
// window's Jacobian (Broyden, Mathematics of Computation 19, 1965).
void UpdateSecant(const FitProblem& problem, Derivatives& derivatives, const FitPoint& from, const FitPoint& to,
                  Residuals residuals);

// The residuals a share of the way from one point to another, by the steps that the derivatives are of.
struct Probe {
  double share;
  const Residuals& residuals;
};

// What bends the way from `from` to `to` (a step of `at`): half the residuals' second derivative along it, answered as
// Reduce answers residuals.
Linearization Bend(const FitProblem& problem, const Linearization& at, const Derivatives& derivatives,
                   const FitPoint& from, const FitPoint& to, const Probe& probe);

// Gives each window of `point` the state of `other` (of the same y) where that costs less; `residuals` and `others` are
// the residuals there. Returns the cost.
double TakeBetterStates(const FitProblem& problem, FitPoint& point, Residuals& residuals, const FitPoint& other,
                        Residuals& others);

// A step that has gone to `point`, of which each window keeps what pays of its state's own way from `states`: all of
// it, shares of it (FitPolicy::state_shares) or nothing, since a motion may tip over on the way. `residuals` are those
// of the whole step, then of what is kept. Returns the cost there.
double ShortenStates(FitProblem& problem, const std::vector<Eigen::VectorXd>& states, FitPoint& point,
                     Residuals& residuals, Work* work);

// What the window's own state answers to a slope of all columns (the last ones are the state's): S^-1 times their part,
// S with what is known of them beforehand.
Eigen::VectorXd StateAnswer(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& prior,
                            const Eigen::VectorXd& slope);

// The step from `y` that minimises gradient' s + 1/2 s' hessian s inside the bounds: a coordinate that would be pushed
// through its bound is put on it, and the rest is solved again.
Eigen::VectorXd BoundedStep(const Eigen::MatrixXd& hessian, const Eigen::VectorXd& gradient, const Eigen::VectorXd& y,
                            const Eigen::VectorXd& low, const Eigen::VectorXd& high);

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_NORMAL_EQUATIONS_H_
