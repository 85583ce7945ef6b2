// Minimises a FitProblem's cost. All methods see the problem with the window states eliminated.
#ifndef GAPSCOPE_TUNE_SOLVE_H_
#define GAPSCOPE_TUNE_SOLVE_H_

#include <chrono>
#include <functional>
#include <optional>
#include <string>

#include "src/tune/fit_problem.h"

namespace gapscope {

// kLevenbergMarquardt uses the normal equations (Marquardt, "An algorithm for least-squares estimation of nonlinear
// parameters", SIAM J. 11, 1963, with bounds by an active set); the others are NLopt's, gradient-based (SLSQP, MMA),
// local without gradient (BOBYQA) and global (CRS2, ISRES, DIRECT).
enum class Optimizer { kLevenbergMarquardt, kSlsqp, kMma, kBobyqa, kCrs2, kIsres, kDirect };
const std::vector<std::string>& OptimizerNames();  // "lm", "slsqp" ..., in the order of the enum

using Deadline = std::optional<std::chrono::steady_clock::time_point>;

struct Progress {
  double best = 0;  // cost
  std::size_t evaluations = 0;
  int iteration = 0;
};

// True ends the fit.
using GiveUp = std::function<bool(double cost, int iteration)>;

struct SolveOptions {
  Optimizer optimizer = Optimizer::kLevenbergMarquardt;
  int max_iterations = 60;  // of LM; NLopt: evaluations = 20 times that
  double tolerance = 1e-4;  // stop when a step lowers the cost by less than this share
  double coarse_step = 0.05,
         fine_step = 0.01;  // finite differences, in search coordinates: first coarse, once converged fine
  double damping = 1e-2;    // LM: of the first step, relative to the diagonal
  bool central = false;  // LM: central differences, whose columns of parameters that only act as a ratio are parallel
  bool secant = true;    // LM: between two Jacobians, steps with secant updates of the last one
  GiveUp give_up;        // asked before each Jacobian
  Deadline deadline;
  unsigned long seed = 0;
  std::function<void(const Progress&)> progress;
};

enum class Termination { kConverged, kIterations, kBudget, kStalled, kHopeless, kNotSimulated };
std::string TerminationText(Termination termination);

struct SolveResult {
  FitPoint point;
  double cost = 0;
  Termination termination = Termination::kConverged;
  int iterations = 0;
};

SolveResult Solve(FitProblem& problem, const FitPoint& start, const SolveOptions& options);

// Only the window states, at fixed y: a few Gauss-Newton steps.
FitPoint SolveStates(FitProblem& problem, FitPoint point, int steps);

}  // namespace gapscope

#endif  // GAPSCOPE_TUNE_SOLVE_H_
