#include "src/fit/lm.h"

#include <algorithm>
#include <cmath>

#include "src/fit/checkpoint.h"
#include "src/fit/objective.h"
#include "src/fit/policy.h"

namespace gapscope {
namespace {

using Columns = DifferenceOptions::Columns;

// Where a run is between two Jacobians. The residuals at the point are not journaled.
struct LmState : Checkpoint {
  Residuals residuals;
  std::shared_ptr<Derivatives> derivatives;  // at the point; nor are these
};

// One run: the problem, how it is asked to be solved, and where it is.
class LmRun {
 public:
  LmRun(FitProblem& problem, const SolveOptions& options, LmState* state)
      : problem_(problem), options_(options), s_(*state) {}

  // One Jacobian, and the steps made with it.
  void Iterate();
  // Steps with a Jacobian of elsewhere.
  void IterateInherited() {
    s_.derivatives = std::make_shared<Derivatives>(*options_.inherited);
    SecantSteps(*s_.derivatives);
    ++s_.iterations;
  }

 private:
  double Cost(const FitPoint& point, Residuals* residuals, StepKind steps = StepKind::kOwn) {
    Evaluation evaluation = problem_.Evaluate(point, Keep::kResiduals, {}, steps);
    s_.work += evaluation.work;
    *residuals = std::move(evaluation.residuals);
    return evaluation.cost;
  }
  Eigen::VectorXd DampedStep(const Linearization& at, const FitPoint& point, double damping) const;
  Eigen::VectorXd DampedStep(const Linearization& at, const FitPoint& point) const {
    return DampedStep(at, point, s_.damping);
  }
  FitPoint BentStep(const Derivatives& derivatives, const Linearization& at, const Eigen::VectorXd& step);
  double TryStep(const Derivatives& derivatives, const Linearization& at, const Eigen::VectorXd& step, FitPoint* trial,
                 Residuals* residuals);
  void SecantSteps(Derivatives& derivatives);
  void Take(FitPoint point, double cost, Residuals residuals, double shrink) {
    s_.point = std::move(point);
    s_.cost = cost;
    s_.residuals = std::move(residuals);
    s_.damping = std::max(s_.damping * shrink, kLmPolicy.least_damping);
  }
  bool IsKink(const Linearization& at) const;
  bool FindOtherStates();
  void End(Termination termination) { s_.done = true, s_.termination = termination; }

  FitProblem& problem_;
  const SolveOptions& options_;
  LmState& s_;
};

// What a linear model promises of a step.
double Promised(const Linearization& at, const Eigen::VectorXd& step) {
  return -at.gradient.dot(step) - 0.5 * step.dot(at.hessian * step);
}

Eigen::VectorXd LmRun::DampedStep(const Linearization& at, const FitPoint& point, double damping) const {
  if (point.y.size() == 0) return {};
  Eigen::MatrixXd hessian = at.hessian;
  hessian.diagonal() +=
      damping * at.hessian.diagonal().cwiseMax(1e-12 * std::max(at.hessian.diagonal().maxCoeff(), 1e-300));
  return BoundedStep(hessian, at.gradient, point.y, problem_.layout().low, problem_.layout().high);
}

// Moves on with the Jacobian of the last linearization, kept up by secant updates: a step costs one replay instead of
// one per column. Ends when a step gains less than promised, or little: only a true Jacobian can tell the bottom.
void LmRun::SecantSteps(Derivatives& derivatives) {
  Residuals residuals;
  for (int i = 0; i < kLmPolicy.most_secant_steps && !IsLate(options_.deadline); ++i) {
    const Linearization at = Reduce(problem_, s_.point, derivatives, Blocks::kNone);
    const Eigen::VectorXd step = DampedStep(at, s_.point);
    const FitPoint trial = Move(problem_, s_.point, at, step);
    const double cost = Cost(trial, &residuals);
    if (!(cost < s_.cost)) return;
    const double gained = s_.cost - cost;
    UpdateSecant(problem_, derivatives, s_.point, trial, residuals);
    Take(trial, cost, std::move(residuals), kLmPolicy.secant_shrink);
    if (gained < kLmPolicy.poor_ratio * Promised(at, step)) return;
    if (gained < 3 * options_.tolerance * cost) {
      s_.difference = options_.fine_step;  // near the bottom, which the finer difference sees better
      return;
    }
  }
}

// The step, bent along a curved valley by the residuals' second derivative along it (geodesic acceleration: Transtrum
// and Sethna, "Improvements to the Levenberg-Marquardt algorithm for nonlinear least-squares minimization",
// arXiv:1201.5885, 2012): one replay, where straight steps down such a valley take many Jacobians.
FitPoint LmRun::BentStep(const Derivatives& derivatives, const Linearization& at, const Eigen::VectorXd& step) {
  FitPoint straight = Move(problem_, s_.point, at, step);
  const double share = kLmPolicy.bend_share;
  FitPoint probe = s_.point;
  probe.y += share * (straight.y - s_.point.y);
  for (std::size_t w = 0; w < probe.states.size(); ++w)
    probe.states[w] += share * (straight.states[w] - s_.point.states[w]);
  Residuals residuals;
  // From what the Jacobian is of: a bend is a small difference beside it.
  if (!std::isfinite(Cost(probe, &residuals, derivatives.steps()))) return straight;
  const Linearization bend = Bend(problem_, at, derivatives, s_.point, straight, {share, residuals});
  const Eigen::VectorXd correction = DampedStep(bend, straight);
  const auto length = [&](const Eigen::VectorXd& v) {
    return std::sqrt(std::max(0.0, v.dot(at.hessian * v) + s_.damping * v.cwiseAbs2().dot(at.hessian.diagonal())));
  };
  if (2 * length(correction) > kLmPolicy.most_bend * length(step)) return straight;
  return Move(problem_, straight, bend, correction);
}

double LmRun::TryStep(const Derivatives& derivatives, const Linearization& at, const Eigen::VectorXd& step,
                      FitPoint* trial, Residuals* residuals) {
  *trial = BentStep(derivatives, at, step);
  const double cost = Cost(*trial, residuals);
  if (cost < s_.cost) return cost;
  // States take whole steps, however damped y is.
  return ShortenStates(problem_, s_.point.states, *trial, *residuals, &s_.work);
}

// Where the linear model goes on promising what no step gains, some window's motion has a kink (a blow), and what no
// signal says of its start may stand on the wrong side.
bool LmRun::IsKink(const Linearization& at) const {
  const bool hidden = !problem_.model().mirrored_joints().empty() ||
                      std::ranges::any_of(problem_.layout().unseen, [](const auto& log) { return !log.dofs.empty(); });
  if (!hidden) return false;
  const Eigen::VectorXd step = DampedStep(at, s_.point, kLmPolicy.least_damping);
  return Promised(at, step) > kLmPolicy.kink * s_.cost;
}

// Whether windows' states found anew, from where the log has them, lead on.
bool LmRun::FindOtherStates() {
  ProblemObjective objective(problem_);
  FitPoint anew = s_.point;
  for (auto& state : anew.states) state.setZero();
  anew = SolveStates(problem_, objective, anew, 3, &s_.work);
  Residuals residuals;
  (void)Cost(anew, &residuals);
  const double before = s_.cost;
  s_.cost = TakeBetterStates(problem_, s_.point, s_.residuals, anew, residuals);
  return before - s_.cost > kLmPolicy.kink * before;
}

void LmRun::Iterate() {
  // What looks far ahead needs no exact motion; the bottom does.
  const DifferenceOptions differences{
      .step = s_.difference,
      .columns = options_.central ? Columns::kCentral : Columns::kAll,
      .steps = s_.difference > options_.fine_step ? options_.coarse_steps : StepKind::kOwn};
  s_.derivatives =
      std::make_shared<Derivatives>(problem_.Differentiate(s_.point, differences, std::move(s_.residuals)));
  Derivatives& derivatives = *s_.derivatives;
  s_.work += derivatives.work;
  s_.residuals = derivatives.residuals;
  const Linearization at = Reduce(problem_, s_.point, derivatives, Blocks::kNone);
  if (!at.valid) return End(Termination::kNotSimulated);
  bool accepted = false, small = false, undamped = false;
  for (int rejected = 0; s_.damping <= kLmPolicy.most_damping && !IsLate(options_.deadline); ++rejected) {
    const Eigen::VectorXd step = DampedStep(at, s_.point);
    // More damping only makes the step smaller: what it promises must be worth the replay. What little is left is for
    // the finer difference to find.
    const bool coarse = s_.difference > options_.fine_step;
    const double worthwhile = coarse ? kLmPolicy.worthwhile_coarse : kLmPolicy.worthwhile;
    if (rejected >= (coarse ? 1 : 2) && Promised(at, step) < worthwhile * options_.tolerance * s_.cost) break;
    FitPoint trial;
    Residuals residuals;
    const double cost = TryStep(derivatives, at, step, &trial, &residuals);
    if (cost < s_.cost) {
      small = s_.cost - cost < options_.tolerance * s_.cost;
      undamped = s_.damping <= kLmPolicy.small_damping;
      accepted = true;
      if (options_.secant) UpdateSecant(problem_, derivatives, s_.point, trial, residuals);
      Take(std::move(trial), cost, std::move(residuals), kLmPolicy.shrink);
      options_.secant ? SecantSteps(derivatives) : s_.derivatives.reset();
      break;
    }
    const double first = kLmPolicy.first_rejection;
    s_.damping = s_.damping < first ? first : s_.damping * kLmPolicy.grow;
  }
  ++s_.iterations;
  if (accepted && !small) {
    s_.quiet = 0;
    return;
  }
  // Done with this finite difference: the finer one sees the bottom better.
  if (s_.difference > options_.fine_step) {
    s_.difference = options_.fine_step;
    s_.damping = std::min(s_.damping, kLmPolicy.small_damping);
    return;
  }
  // A small step means the bottom when it was hardly damped, or when it happens again and again (a narrow valley).
  if (accepted && ++s_.quiet < (undamped ? 1 : 3)) return;
  if (IsKink(at) && FindOtherStates()) {
    s_.difference = options_.coarse_step;
    s_.damping = options_.damping;
    s_.quiet = 0;
    return;
  }
  End(accepted || s_.iterations > 1 ? Termination::kConverged : Termination::kStalled);
}

// Iterations until one says that it is done, or something ends the run.
void Run(const SolveTask& task, const SolveOptions& options, LmState* s) {
  LmRun run(task.problem, options, s);
  while (s->iterations < options.max_iterations && !s->done) {
    if (std::vector<double> record; task.journal && task.journal->Next(CallAt("iterate", s->point), &record)) {
      Unpack(record, s);
      s->residuals.clear();
      continue;
    }
    if (IsLate(options.deadline)) {
      s->termination = Termination::kBudget;
      return;
    }
    if (options.give_up && options.give_up(s->cost, s->iterations)) {
      s->termination = Termination::kHopeless;
      return;
    }
    const FitPoint before = s->point;
    // Resumed: what the journal did not keep is no new work.
    if (s->residuals.empty()) s->residuals = task.problem.Evaluate(s->point, Keep::kResiduals).residuals;
    options.inherited && s->iterations == 0 ? run.IterateInherited() : run.Iterate();
    if (options.progress)
      options.progress({.best = s->cost, .evaluations = s->work.evaluations, .iteration = s->iterations});
    // An iteration that the deadline cut short is made anew.
    if (task.journal && !IsLate(options.deadline)) task.journal->Append(CallAt("iterate", before), Pack(*s));
  }
}

}  // namespace

SolveResult SolveLm(const SolveTask& task, const FitPoint& start, const SolveOptions& options, const OptimizerRow&) {
  Evaluation first = task.objective.Evaluate(start, Keep::kResiduals);
  LmState s;
  s.point = start;
  s.residuals = std::move(first.residuals);
  s.cost = first.cost, s.damping = options.damping, s.difference = options.coarse_step;
  s.work = first.work;
  const bool any_state =
      std::any_of(start.states.begin(), start.states.end(), [](const auto& state) { return state.size() > 0; });
  if (!std::isfinite(s.cost)) {
    s.termination = Termination::kNotSimulated;
  } else if (start.y.size() == 0 && !any_state) {
    s.termination = Termination::kConverged;
  } else {
    Run(task, options, &s);
  }
  return {.point = s.point,
          .cost = s.cost,
          .termination = s.termination,
          .iterations = s.iterations,
          .work = s.work,
          .derivatives = s.derivatives};
}

}  // namespace gapscope
