#include "src/tune/solve.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlopt.hpp>

namespace gapscope {
namespace {

constexpr double kLeastDamping = 1e-9;

bool Late(const Deadline& deadline) { return deadline && std::chrono::steady_clock::now() >= *deadline; }

// The damped step inside the bounds: a coordinate that the step would push through its bound is put on it and the rest is solved again.
Eigen::VectorXd BoundedStep(const Linearization& at, const FitPoint& point, const Eigen::VectorXd& low, const Eigen::VectorXd& high, double damping) {
  const Eigen::Index n = point.y.size();
  if (n == 0) return Eigen::VectorXd();
  Eigen::MatrixXd hessian = at.hessian;
  hessian.diagonal() += damping * at.hessian.diagonal().cwiseMax(1e-12 * std::max(at.hessian.diagonal().maxCoeff(), 1e-300));
  Eigen::VectorXd step = Eigen::VectorXd::Zero(n);
  std::vector<char> fixed(static_cast<std::size_t>(n), 0);
  for (Eigen::Index round = 0; round <= n; ++round) {
    std::vector<Eigen::Index> free;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (!fixed[static_cast<std::size_t>(i)]) free.push_back(i);
    }
    if (free.empty()) break;
    const auto k = static_cast<Eigen::Index>(free.size());
    Eigen::MatrixXd h(k, k);
    Eigen::VectorXd g(k);
    for (Eigen::Index a = 0; a < k; ++a) {
      g[a] = -at.gradient[free[static_cast<std::size_t>(a)]];
      for (Eigen::Index j = 0; j < n; ++j) {
        if (fixed[static_cast<std::size_t>(j)]) g[a] -= at.hessian(free[static_cast<std::size_t>(a)], j) * step[j];
      }
      for (Eigen::Index b = 0; b < k; ++b) h(a, b) = hessian(free[static_cast<std::size_t>(a)], free[static_cast<std::size_t>(b)]);
    }
    const Eigen::VectorXd solution = h.ldlt().solve(g);
    bool again = false;
    for (Eigen::Index a = 0; a < k; ++a) {
      const Eigen::Index i = free[static_cast<std::size_t>(a)];
      const double target = point.y[i] + solution[a];
      step[i] = std::isfinite(solution[a]) ? std::clamp(target, low[i], high[i]) - point.y[i] : 0;
      if (!std::isfinite(solution[a]) || target < low[i] || target > high[i]) fixed[static_cast<std::size_t>(i)] = 1, again = true;
    }
    if (!again) break;
  }
  return step;
}

// Moves on with the Jacobian of the last linearization, kept up by secant updates: a step costs one replay instead of one per column. Ends when a step
// gains less than promised, or little: only a true Jacobian can tell the bottom.
void SecantSteps(FitProblem& problem, Snapshot& snapshot, const SolveOptions& options, std::vector<Eigen::VectorXd>& residuals, double* damping, SolveResult* result) {
  constexpr int kMostSteps = 8;
  constexpr double kPoorRatio = 0.2;  // of the promised gain
  for (int i = 0; i < kMostSteps && !Late(options.deadline); ++i) {
    const Linearization at = problem.Reduce(result->point, snapshot, false);
    const Eigen::VectorXd step = BoundedStep(at, result->point, problem.low(), problem.high(), *damping);
    const FitPoint trial = problem.Move(result->point, at, step);
    const double cost = problem.CostAndResiduals(trial, &residuals);
    if (!(cost < result->cost)) return;
    const double gained = result->cost - cost, promised = -at.gradient.dot(step) - 0.5 * step.dot(at.hessian * step);
    problem.UpdateSecant(snapshot, result->point, trial, std::move(residuals));
    result->point = trial;
    result->cost = cost;
    *damping = std::max(*damping * 0.3, kLeastDamping);
    if (gained < 3 * options.tolerance * cost || gained < kPoorRatio * promised) return;
  }
}

SolveResult LevenbergMarquardt(FitProblem& problem, const FitPoint& start, const SolveOptions& options) {
  constexpr double kMostDamping = 1e8, kSmallDamping = 1e-3, kWorthwhile = 0.1;
  SolveResult result{.point = start, .cost = problem.Cost(start), .termination = Termination::kIterations};
  if (!std::isfinite(result.cost)) {
    result.termination = Termination::kNotSimulated;
    return result;
  }
  const bool any_state = std::any_of(start.states.begin(), start.states.end(), [](const auto& state) { return state.size() > 0; });
  if (start.y.size() == 0 && !any_state) {
    result.termination = Termination::kConverged;
    return result;
  }
  const auto columns = options.central ? FitProblem::Columns::kCentral : FitProblem::Columns::kAll;
  const bool secant = options.secant && !problem.journaled();
  double damping = options.damping, difference = options.coarse_step;
  int quiet = 0;
  for (; result.iterations < options.max_iterations; ++result.iterations) {
    if (Late(options.deadline)) {
      result.termination = Termination::kBudget;
      return result;
    }
    if (options.hopeless && options.hopeless(result.cost, result.iterations)) {
      result.termination = Termination::kHopeless;
      return result;
    }
    Snapshot snapshot;
    Linearization at;
    if (secant) {
      snapshot = problem.Differentiate(result.point, difference, columns);
      at = problem.Reduce(result.point, snapshot, false);
    } else {
      at = problem.Linearize(result.point, difference, columns);
    }
    if (!at.valid) {
      result.termination = Termination::kNotSimulated;
      return result;
    }
    bool accepted = false, small = false, undamped = false;
    for (int rejected = 0; damping <= kMostDamping && !Late(options.deadline); ++rejected) {
      const Eigen::VectorXd step = BoundedStep(at, result.point, problem.low(), problem.high(), damping);
      // More damping only makes the step smaller: what it promises must be worth the replay.
      const double promised = -at.gradient.dot(step) - 0.5 * step.dot(at.hessian * step);
      if (rejected >= 2 && promised < kWorthwhile * options.tolerance * result.cost) break;
      const FitPoint trial = problem.Move(result.point, at, step);
      std::vector<Eigen::VectorXd> residuals;
      const double cost = secant ? problem.CostAndResiduals(trial, &residuals) : problem.Cost(trial);
      if (cost < result.cost) {
        small = result.cost - cost < options.tolerance * result.cost;
        undamped = damping <= kSmallDamping;
        damping = std::max(damping * 0.1, kLeastDamping);
        accepted = true;
        if (secant && !small) problem.UpdateSecant(snapshot, result.point, trial, std::move(residuals));
        result.point = trial;
        result.cost = cost;
        if (secant && !small) SecantSteps(problem, snapshot, options, residuals, &damping, &result);
        break;
      }
      damping = damping < 1e-3 ? 1e-3 : damping * 8;
    }
    if (options.progress) options.progress({.best = result.cost, .evaluations = problem.evaluations(), .iteration = result.iterations});
    if (accepted && !small) {
      quiet = 0;
      continue;
    }
    // Done with this finite difference: the finer one sees the bottom better.
    if (difference > options.fine_step) {
      difference = options.fine_step;
      damping = std::min(damping, options.damping);
      continue;
    }
    // A small step means the bottom when it was hardly damped, or when it happens again and again (a narrow valley).
    if (accepted && ++quiet < (undamped ? 1 : 3)) continue;
    result.termination = accepted || result.iterations > 0 ? Termination::kConverged : Termination::kStalled;
    ++result.iterations;
    return result;
  }
  return result;
}

// What NLopt's callbacks share. Nothing may be thrown through NLopt's C code.
struct NloptRun {
  FitProblem* problem;
  const SolveOptions* options;
  FitPoint point;       // states are carried from one evaluation to the next
  SolveResult best;
  bool gradient;
  bool stop = false;
};

double Evaluate(const std::vector<double>& y, std::vector<double>& gradient, void* data) {
  auto* run = static_cast<NloptRun*>(data);
  if (run->stop || Late(run->options->deadline)) {
    run->stop = true;
    throw nlopt::forced_stop();  // nlopt's own C++ wrapper catches and remembers it
  }
  run->point.y = Eigen::Map<const Eigen::VectorXd>(y.data(), static_cast<Eigen::Index>(y.size()));
  run->point = SolveStates(*run->problem, run->point, 1);
  double cost = 0;
  if (!gradient.empty()) {
    const Linearization at = run->problem->Linearize(run->point, run->options->fine_step);
    cost = at.valid ? at.cost : HUGE_VAL;
    for (std::size_t i = 0; i < gradient.size(); ++i) gradient[i] = at.valid ? at.gradient[static_cast<Eigen::Index>(i)] : 0;
  } else {
    cost = run->problem->Cost(run->point);
  }
  if (cost < run->best.cost) {
    run->best.cost = cost;
    run->best.point = run->point;
  }
  if (run->options->progress) run->options->progress({.best = run->best.cost, .evaluations = run->problem->evaluations(), .iteration = ++run->best.iterations});
  return std::isfinite(cost) ? cost : 1e300;
}

SolveResult WithNlopt(FitProblem& problem, const FitPoint& start, const SolveOptions& options) {
  constexpr nlopt::algorithm kAlgorithms[] = {nlopt::LD_SLSQP, nlopt::LD_SLSQP, nlopt::LD_MMA, nlopt::LN_BOBYQA, nlopt::GN_CRS2_LM, nlopt::GN_ISRES, nlopt::GN_DIRECT_L};
  const auto n = static_cast<unsigned>(start.y.size());
  NloptRun run{.problem = &problem, .options = &options, .point = start};
  run.best.point = start;
  run.best.cost = problem.Cost(start);
  if (n == 0) return run.best;
  nlopt::srand(options.seed + 1);
  nlopt::opt opt(kAlgorithms[static_cast<int>(options.optimizer)], n);
  opt.set_lower_bounds(std::vector<double>(problem.low().data(), problem.low().data() + n));
  opt.set_upper_bounds(std::vector<double>(problem.high().data(), problem.high().data() + n));
  opt.set_min_objective(Evaluate, &run);
  opt.set_ftol_rel(options.tolerance * 0.1);
  opt.set_maxeval(options.max_iterations * (options.optimizer >= Optimizer::kBobyqa ? 40 : 4));
  std::vector<double> step(n);
  for (unsigned i = 0; i < n; ++i) step[i] = 0.1 * (problem.high()[i] - problem.low()[i]);
  opt.set_initial_step(step);
  std::vector<double> y(start.y.data(), start.y.data() + n);
  double cost = 0;
  run.best.termination = Termination::kConverged;
  try {
    if (opt.optimize(y, cost) == nlopt::MAXEVAL_REACHED) run.best.termination = Termination::kIterations;
  } catch (const nlopt::roundoff_limited&) {
    run.best.termination = Termination::kConverged;  // no further progress is possible in double precision
  } catch (const nlopt::forced_stop&) {
    run.best.termination = Termination::kBudget;
  } catch (const std::exception&) {
    run.best.termination = Termination::kStalled;
  }
  // NLopt may return another point than the best it saw.
  return run.best;
}

}  // namespace

const std::vector<std::string>& OptimizerNames() {
  static const std::vector<std::string> names = {"lm", "slsqp", "mma", "bobyqa", "crs2", "isres", "direct"};
  return names;
}

std::string TerminationText(Termination termination) {
  switch (termination) {
    case Termination::kConverged: return "converged";
    case Termination::kIterations: return "iteration limit";
    case Termination::kBudget: return "budget spent";
    case Termination::kStalled: return "stalled at the start";
    case Termination::kHopeless: return "given up: far behind";
    case Termination::kNotSimulated: return "the start cannot be simulated";
  }
  return "";
}

FitPoint SolveStates(FitProblem& problem, FitPoint point, int steps) {
  if (point.states.empty() || point.states.front().size() == 0) return point;
  for (int i = 0; i < steps; ++i) {
    const Linearization at = problem.Linearize(point, 0.01, FitProblem::Columns::kStates);
    if (!at.valid) break;
    point = problem.Move(point, at, Eigen::VectorXd::Zero(point.y.size()));
  }
  return point;
}

SolveResult Solve(FitProblem& problem, const FitPoint& start, const SolveOptions& options) {
  if (options.optimizer == Optimizer::kLevenbergMarquardt) return LevenbergMarquardt(problem, start, options);
  SolveResult found = WithNlopt(problem, start, options);
  return found;
}

}  // namespace gapscope
