#include "src/tune/solve.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlopt.hpp>

#include "src/tune/journal.h"

namespace gapscope {
namespace {

constexpr double kLeastDamping = 1e-9, kSmallDamping = 1e-3;

bool Late(const Deadline& deadline) { return deadline && std::chrono::steady_clock::now() >= *deadline; }

// The damped step inside the bounds: a coordinate that the step would push through its bound is put on it and the rest
// is solved again.
Eigen::VectorXd BoundedStep(const Linearization& at, const FitPoint& point, const Eigen::VectorXd& low,
                            const Eigen::VectorXd& high, double damping) {
  const Eigen::Index n = point.y.size();
  if (n == 0) return Eigen::VectorXd();
  Eigen::MatrixXd hessian = at.hessian;
  hessian.diagonal() +=
      damping * at.hessian.diagonal().cwiseMax(1e-12 * std::max(at.hessian.diagonal().maxCoeff(), 1e-300));
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
      for (Eigen::Index b = 0; b < k; ++b)
        h(a, b) = hessian(free[static_cast<std::size_t>(a)], free[static_cast<std::size_t>(b)]);
    }
    const Eigen::VectorXd solution = h.ldlt().solve(g);
    bool again = false;
    for (Eigen::Index a = 0; a < k; ++a) {
      const Eigen::Index i = free[static_cast<std::size_t>(a)];
      const double target = point.y[i] + solution[a];
      step[i] = std::isfinite(solution[a]) ? std::clamp(target, low[i], high[i]) - point.y[i] : 0;
      if (!std::isfinite(solution[a]) || target < low[i] || target > high[i])
        fixed[static_cast<std::size_t>(i)] = 1, again = true;
    }
    if (!again) break;
  }
  return step;
}

// Where a Levenberg-Marquardt run is between two Jacobians: all that it takes to go on.
struct LmState {
  FitPoint point;
  std::vector<Eigen::VectorXd> residuals;  // at the point; not journaled
  double cost = 0, damping = 0, difference = 0;
  int quiet = 0, iterations = 0;
  bool done = false;
  Termination termination = Termination::kIterations;
};

std::vector<double> Pack(const LmState& s, std::size_t evaluations, std::size_t replays) {
  std::vector<double> record = {s.cost,
                                s.damping,
                                s.difference,
                                static_cast<double>(s.quiet),
                                static_cast<double>(s.iterations),
                                static_cast<double>(s.done),
                                static_cast<double>(s.termination),
                                static_cast<double>(evaluations),
                                static_cast<double>(replays)};
  record.insert(record.end(), s.point.y.begin(), s.point.y.end());
  for (const auto& state : s.point.states) record.insert(record.end(), state.begin(), state.end());
  return record;
}

void Unpack(const std::vector<double>& record, LmState* s, FitProblem* problem) {
  s->residuals.clear();
  s->cost = record[0], s->damping = record[1], s->difference = record[2];
  s->quiet = static_cast<int>(record[3]), s->iterations = static_cast<int>(record[4]), s->done = record[5] != 0;
  s->termination = static_cast<Termination>(static_cast<int>(record[6]));
  problem->CountResumed(static_cast<std::size_t>(record[7]), static_cast<std::size_t>(record[8]));
  std::size_t at = 9;
  for (double& y : s->point.y) y = record[at++];
  for (auto& state : s->point.states) {
    for (double& x : state) x = record[at++];
  }
}

// Moves on with the Jacobian of the last linearization, kept up by secant updates: a step costs one replay instead of
// one per column. Ends when a step gains less than promised, or little: only a true Jacobian can tell the bottom.
void SecantSteps(FitProblem& problem, Snapshot& snapshot, const SolveOptions& options, LmState* s) {
  constexpr int kMostSteps = 8;
  constexpr double kPoorRatio = 0.2;  // of the promised gain
  std::vector<Eigen::VectorXd> residuals;
  for (int i = 0; i < kMostSteps && !Late(options.deadline); ++i) {
    const Linearization at = problem.Reduce(s->point, snapshot, false);
    const Eigen::VectorXd step = BoundedStep(at, s->point, problem.low(), problem.high(), s->damping);
    const FitPoint trial = problem.Move(s->point, at, step);
    const double cost = problem.CostAndResiduals(trial, &residuals);
    if (!(cost < s->cost)) return;
    const double gained = s->cost - cost, promised = -at.gradient.dot(step) - 0.5 * step.dot(at.hessian * step);
    problem.UpdateSecant(snapshot, s->point, trial, residuals);
    s->point = trial;
    s->cost = cost;
    s->residuals = std::move(residuals);
    s->damping = std::max(s->damping * 0.3, kLeastDamping);
    if (gained < kPoorRatio * promised) return;
    if (gained < 3 * options.tolerance * cost) {
      s->difference = options.fine_step;  // near the bottom, which the finer difference sees better
      return;
    }
  }
}

// The step, bent along a curved valley by the residuals' second derivative along it (geodesic acceleration: Transtrum
// and Sethna, "Improvements to the Levenberg-Marquardt algorithm for nonlinear least-squares minimization",
// arXiv:1201.5885, 2012): one replay, where straight steps down such a valley take many Jacobians.
FitPoint BentStep(FitProblem& problem, const Snapshot& snapshot, const Linearization& at, const LmState& s,
                  const Eigen::VectorXd& step) {
  constexpr double kShare = 0.1;  // of the step, at which the bend is measured
  constexpr double kMostBend =
      0.75;  // |acceleration| / |velocity|, beyond which the second derivative tells nothing about the whole step
  const FitPoint straight = problem.Move(s.point, at, step);
  FitPoint probe = s.point;
  probe.y += kShare * (straight.y - s.point.y);
  for (std::size_t w = 0; w < probe.states.size(); ++w)
    probe.states[w] += kShare * (straight.states[w] - s.point.states[w]);
  std::vector<Eigen::VectorXd> residuals;
  if (!std::isfinite(problem.CostAndResiduals(probe, &residuals))) return straight;
  const Linearization bend = problem.Bend(at, snapshot, s.point, straight, kShare, residuals);
  const Eigen::VectorXd correction = BoundedStep(bend, straight, problem.low(), problem.high(), s.damping);
  const auto length = [&](const Eigen::VectorXd& v) {
    return std::sqrt(std::max(0.0, v.dot(at.hessian * v) + s.damping * v.cwiseAbs2().dot(at.hessian.diagonal())));
  };
  if (2 * length(correction) > kMostBend * length(step)) return straight;
  return problem.Move(straight, bend, correction);
}

// One Jacobian, and the steps made with it.
void Iterate(FitProblem& problem, const SolveOptions& options, LmState* s) {
  constexpr double kMostDamping = 1e8, kWorthwhile = 0.1, kWorthwhileCoarse = 10;  // shares of the tolerance
  Snapshot snapshot = problem.Differentiate(s->point, s->difference,
                                            options.central ? FitProblem::Columns::kCentral : FitProblem::Columns::kAll,
                                            std::move(s->residuals));
  s->residuals = snapshot.residuals;
  const Linearization at = problem.Reduce(s->point, snapshot, false);
  const auto end = [&](Termination termination) { s->done = true, s->termination = termination; };
  if (!at.valid) return end(Termination::kNotSimulated);
  bool accepted = false, small = false, undamped = false;
  for (int rejected = 0; s->damping <= kMostDamping && !Late(options.deadline); ++rejected) {
    const Eigen::VectorXd step = BoundedStep(at, s->point, problem.low(), problem.high(), s->damping);
    // More damping only makes the step smaller: what it promises must be worth the replay.
    const double promised = -at.gradient.dot(step) - 0.5 * step.dot(at.hessian * step);
    // What little is left is for the finer difference to find.
    const bool coarse = s->difference > options.fine_step;
    if (rejected >= (coarse ? 1 : 2) &&
        promised < (coarse ? kWorthwhileCoarse : kWorthwhile) * options.tolerance * s->cost)
      break;
    FitPoint trial = BentStep(problem, snapshot, at, *s, step);
    std::vector<Eigen::VectorXd> residuals;
    double cost = problem.CostAndResiduals(trial, &residuals);
    if (!(cost < s->cost)) {
      // States take whole steps, however damped y is: where a window's motion tips over at the least touch, better
      // none.
      std::vector<Eigen::VectorXd> others;
      const FitPoint still{.y = trial.y, .states = s->point.states};
      problem.CostAndResiduals(still, &others);
      cost = problem.TakeBetterStates(trial, residuals, still, others);
    }
    if (cost < s->cost) {
      small = s->cost - cost < options.tolerance * s->cost;
      undamped = s->damping <= kSmallDamping;
      s->damping = std::max(s->damping * 0.1, kLeastDamping);
      accepted = true;
      const bool go_on = options.secant;
      if (go_on) problem.UpdateSecant(snapshot, s->point, trial, residuals);
      s->point = trial;
      s->cost = cost;
      s->residuals = std::move(residuals);
      if (go_on) SecantSteps(problem, snapshot, options, s);
      break;
    }
    s->damping = s->damping < 1e-3 ? 1e-3 : s->damping * 8;
  }
  ++s->iterations;
  if (accepted && !small) {
    s->quiet = 0;
    return;
  }
  // Done with this finite difference: the finer one sees the bottom better.
  if (s->difference > options.fine_step) {
    s->difference = options.fine_step;
    s->damping = std::min(s->damping, kSmallDamping);
    return;
  }
  // A small step means the bottom when it was hardly damped, or when it happens again and again (a narrow valley).
  if (accepted && ++s->quiet < (undamped ? 1 : 3)) return;
  end(accepted || s->iterations > 1 ? Termination::kConverged : Termination::kStalled);
}

SolveResult LevenbergMarquardt(FitProblem& problem, const FitPoint& start, const SolveOptions& options) {
  LmState s{.point = start, .damping = options.damping, .difference = options.coarse_step};
  s.cost = problem.Cost(start, nullptr, &s.residuals);
  const bool any_state =
      std::any_of(start.states.begin(), start.states.end(), [](const auto& state) { return state.size() > 0; });
  if (!std::isfinite(s.cost)) {
    s.termination = Termination::kNotSimulated;
  } else if (start.y.size() == 0 && !any_state) {
    s.termination = Termination::kConverged;
  } else {
    while (s.iterations < options.max_iterations && !s.done) {
      std::vector<double> record;
      if (problem.journal() && problem.journal()->Next(s.point, &record)) {
        Unpack(record, &s, &problem);
        continue;
      }
      if (Late(options.deadline)) {
        s.termination = Termination::kBudget;
        break;
      }
      if (options.give_up && options.give_up(s.cost, s.iterations)) {
        s.termination = Termination::kHopeless;
        break;
      }
      const FitPoint before = s.point;
      if (s.residuals.empty()) s.residuals = problem.ResidualsAgain(s.point);  // resumed
      const std::size_t evaluations = problem.evaluations(), replays = problem.replays();
      Iterate(problem, options, &s);
      if (options.progress)
        options.progress({.best = s.cost, .evaluations = problem.evaluations(), .iteration = s.iterations});
      // An iteration that the deadline cut short is made anew.
      if (problem.journal() && !Late(options.deadline))
        problem.journal()->Append(before, Pack(s, problem.evaluations() - evaluations, problem.replays() - replays));
    }
  }
  return {.point = s.point, .cost = s.cost, .termination = s.termination, .iterations = s.iterations};
}

// What NLopt's callbacks share. Nothing may be thrown through NLopt's C code.
struct NloptRun {
  FitProblem* problem;
  const SolveOptions* options;
  FitPoint point;  // states are carried from one evaluation to the next
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
    for (std::size_t i = 0; i < gradient.size(); ++i)
      gradient[i] = at.valid ? at.gradient[static_cast<Eigen::Index>(i)] : 0;
  } else {
    cost = run->problem->Cost(run->point);
  }
  if (cost < run->best.cost) {
    run->best.cost = cost;
    run->best.point = run->point;
  }
  if (run->options->progress)
    run->options->progress(
        {.best = run->best.cost, .evaluations = run->problem->evaluations(), .iteration = ++run->best.iterations});
  return std::isfinite(cost) ? cost : 1e300;
}

SolveResult WithNlopt(FitProblem& problem, const FitPoint& start, const SolveOptions& options) {
  constexpr nlopt::algorithm kAlgorithms[] = {nlopt::LD_SLSQP,   nlopt::LD_SLSQP, nlopt::LD_MMA,     nlopt::LN_BOBYQA,
                                              nlopt::GN_CRS2_LM, nlopt::GN_ISRES, nlopt::GN_DIRECT_L};
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
    case Termination::kConverged:
      return "converged";
    case Termination::kIterations:
      return "iteration limit";
    case Termination::kBudget:
      return "budget spent";
    case Termination::kStalled:
      return "stalled at the start";
    case Termination::kHopeless:
      return "given up: far behind";
    case Termination::kNotSimulated:
      return "the start cannot be simulated";
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
