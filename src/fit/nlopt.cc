#include "src/fit/nlopt.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <nlopt.hpp>

#include "src/core/statistics.h"
#include "src/fit/checkpoint.h"

namespace gapscope {
namespace {

struct NloptPolicy {
  int most_rounds = 30;
  int evaluations = 8;              // of a round of a method with gradients
  int evaluations_per_unknown = 8;  // of one without
  double reach = 2;                 // of z: a quadratic cost of one has its bottom at most sqrt(2) away
  double coarse_tolerance = 10;     // times the solve's: what little is left is for the finer difference to find
  double tolerance_share = 0.3;     // of the solve's own, for a round
  int state_steps = 3;              // at most, for the states at one y
  double state_share = 3e-3;        // of the cost: less to be gained by the states is nothing
  // Of the Hessian's diagonal, as in Levenberg-Marquardt: how far a round may go along directions that hardly matter.
  double first_damping = 1e-2, least_damping = 1e-9, shrink = 0.1, grow = 30;
  int most_quiet = 3;             // rounds that gain hardly anything, each nearer than the one before
  double inside = 0.99;           // of the way to a bound, where a coordinate starts that leaves it
  double first_step = 0.5;        // of z, of a method without gradients
  double least_diagonal = 1e-12;  // of the largest one: below it a direction is open, and left where it is
  int search_unit = 100;          // evaluations of a global search per iteration that is allowed
  double not_simulated = 1e3;     // times the start's cost
};
constexpr NloptPolicy kPolicy;

// A point with its derivatives, and the normal equations there.
struct Known {
  FitPoint point;
  Derivatives derivatives;
  Linearization at;
  double cost() const { return at.valid ? at.cost : kInfinity; }
};

// The cost around the point where a round begins: one Jacobian there, then a replay or a few an evaluation. States go
// where the last equations send them, and Broyden's update keeps the Jacobian true along the steps that were made.
class Projected {
 public:
  // `step`: of the finite differences.
  Projected(FitProblem& problem, const SolveOptions& options, double step)
      : problem_(problem), options_(options), step_(step) {}

  // A true Jacobian at a point; false: it cannot be simulated.
  bool Begin(const FitPoint& point) {
    last_.point = point;
    last_.derivatives = problem_.Differentiate(point, {.step = step_});
    last_.at = Reduce(problem_, point, last_.derivatives, Blocks::kNone);
    Count(last_.derivatives.work);
    best_ = last_;
    return last_.at.valid;
  }

  // The cost and the equations at y, the states near their optimum; null: it cannot be simulated there.
  const Known* At(const Eigen::VectorXd& y) {
    FitPoint point = Move(problem_, last_.point, last_.at, y - last_.point.y);
    Evaluation there = Evaluate(point);
    if (!(there.cost < best_.cost()))
      there.cost = ShortenStates(problem_, best_.point.states, point, there.residuals, &work_);
    if (!std::isfinite(there.cost)) return nullptr;
    Follow(point, std::move(there.residuals));
    for (int step = 1; step < kPolicy.state_steps; ++step) {
      const double before = last_.cost();
      if (before - last_.at.reduced_cost < kPolicy.state_share * before) break;
      const FitPoint from = last_.point;
      Residuals residuals = last_.derivatives.residuals;
      point = Move(problem_, from, last_.at, Eigen::VectorXd::Zero(y.size()));
      there = Evaluate(point);
      there.cost = TakeBetterStates(problem_, point, there.residuals, from, residuals);
      Follow(point, std::move(there.residuals));
      if (before - last_.cost() < kPolicy.state_share * before) break;
    }
    if (!last_.at.valid) return nullptr;
    if (last_.cost() < best_.cost()) best_ = last_;
    return &last_;
  }

  const Known& best() const { return best_; }
  const Work& work() const { return work_; }
  bool Late() const { return IsLate(options_.deadline); }

 private:
  Evaluation Evaluate(const FitPoint& point) {
    Evaluation there = problem_.Evaluate(point, Keep::kResiduals);
    Count(there.work);
    return there;
  }
  // To a point whose residuals are known, by Broyden's update.
  void Follow(const FitPoint& point, Residuals residuals) {
    UpdateSecant(problem_, last_.derivatives, last_.point, point, std::move(residuals));
    last_.point = point;
    last_.at = Reduce(problem_, point, last_.derivatives, Blocks::kNone);
  }
  void Count(const Work& work) {
    work_ += work;
    if (options_.progress)
      options_.progress({.best = best_.cost(), .evaluations = work_.evaluations, .iteration = ++evaluations_});
  }

  FitProblem& problem_;
  const SolveOptions& options_;
  const double step_;
  Known last_, best_;
  Work work_;
  int evaluations_ = 0;
};

// Coordinates of one round, in units where the cost at z = 0 is one and its Hessian the identity. Bounds are put into a
// smooth map first (James and Roos, "Minuit", Computer Physics Communications 10, 1975): y = middle + half sin(u),
// u = u0 + L^-T z, L L' the Hessian by u.
class Whitened {
 public:
  Whitened(const Known& at, const Eigen::VectorXd& low, const Eigen::VectorXd& high, double damping)
      : middle_(0.5 * (low + high)), half_(0.5 * (high - low)), u0_(middle_.size()), scale_(1 / at.cost()) {
    const Eigen::Index n = u0_.size();
    const Eigen::VectorXd& g = at.at.gradient;
    for (Eigen::Index i = 0; i < n; ++i) {
      const double share = std::clamp((at.point.y[i] - middle_[i]) / half_[i], -1.0, 1.0);
      // On a bound the map stands still: what the slope pulls inside starts a little inside.
      const bool inward = share * g[i] > 0;
      u0_[i] = std::asin(inward ? std::clamp(share, -kPolicy.inside, kPolicy.inside) : share);
    }
    const Eigen::VectorXd slope = half_.cwiseProduct(u0_.array().cos().matrix());
    Eigen::MatrixXd hessian = scale_ * slope.asDiagonal() * at.at.hessian * slope.asDiagonal();
    for (Eigen::Index i = 0; i < n; ++i) hessian(i, i) += std::max(0.0, -scale_ * g[i] * half_[i] * std::sin(u0_[i]));
    const double least = kPolicy.least_diagonal * std::max(hessian.diagonal().maxCoeff(), 1e-300);
    hessian.diagonal() = (hessian.diagonal() * (1 + damping)).cwiseMax(least);
    factor_.compute(hessian);
  }
  bool good() const { return u0_.size() > 0 && factor_.info() == Eigen::Success; }
  Eigen::Index size() const { return u0_.size(); }
  double scale() const { return scale_; }

  Eigen::VectorXd Y(const Eigen::VectorXd& z) const {
    return middle_ + half_.cwiseProduct(U(z).array().sin().matrix());
  }
  // Of the scaled cost by z.
  Eigen::VectorXd Gradient(const Eigen::VectorXd& z, const Eigen::VectorXd& gradient) const {
    const Eigen::VectorXd slope = half_.cwiseProduct(U(z).array().cos().matrix());
    return factor_.matrixL().solve(scale_ * slope.cwiseProduct(gradient));
  }

 private:
  Eigen::VectorXd U(const Eigen::VectorXd& z) const { return u0_ + factor_.matrixU().solve(z); }

  Eigen::VectorXd middle_, half_, u0_;
  double scale_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

// What the callback of a round is given. Nothing may be thrown through NLopt's C code but its own forced_stop, which
// NLopt's C++ wrapper catches and remembers.
struct RoundCall {
  Projected* projected;
  const Whitened* whitened;
};

double CallRound(const std::vector<double>& x, std::vector<double>& gradient, void* data) {
  const auto& [projected, whitened] = *static_cast<RoundCall*>(data);
  if (projected->Late()) throw nlopt::forced_stop();
  const Eigen::VectorXd z = Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(x.size()));
  const Known* known = projected->At(whitened->Y(z));
  if (!gradient.empty()) {
    Eigen::Map<Eigen::VectorXd> out(gradient.data(), z.size());
    out = known ? whitened->Gradient(z, known->at.gradient) : Eigen::VectorXd::Zero(z.size()).eval();
  }
  return known ? whitened->scale() * known->cost() : kPolicy.not_simulated;
}

// What the callback of a global search is given: the argument is y in shares of its range.
struct SearchCall {
  const SolveTask* task;
  const SolveOptions* options;
  FitPoint start;
  double scale;
  FitPoint best;
  double least;
  Work work;
};

double CallSearch(const std::vector<double>& x, std::vector<double>& gradient, void* data) {
  auto& call = *static_cast<SearchCall*>(data);
  if (IsLate(call.options->deadline)) throw nlopt::forced_stop();
  const FitLayout& layout = call.task->problem.layout();
  const Eigen::VectorXd range = layout.high - layout.low;
  const Eigen::VectorXd share = Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(x.size()));
  const FitPoint point{.y = layout.low + share.cwiseProduct(range), .states = call.start.states};
  const auto columns = gradient.empty() ? DifferenceOptions::Columns::kStates : DifferenceOptions::Columns::kAll;
  const Linearization at = call.task->objective.Linearize(point, {.step = call.options->fine_step, .columns = columns});
  call.work += at.work;
  if (!gradient.empty()) {
    Eigen::Map<Eigen::VectorXd> out(gradient.data(), share.size());
    out = at.valid ? (call.scale * at.gradient.cwiseProduct(range)).eval() : Eigen::VectorXd::Zero(share.size()).eval();
  }
  if (!at.valid) return kPolicy.not_simulated;
  if (at.reduced_cost < call.least) {
    call.least = at.reduced_cost;
    call.best = Move(call.task->problem, point, at, Eigen::VectorXd::Zero(share.size()));
  }
  if (call.options->progress) call.options->progress({.best = call.least, .evaluations = call.work.evaluations});
  return call.scale * at.reduced_cost;
}

// Runs what is set up; exceptions become terminations.
Termination Optimize(nlopt::opt& opt, std::vector<double> x) {
  double cost = 0;
  try {
    return opt.optimize(x, cost) == nlopt::MAXEVAL_REACHED ? Termination::kIterations : Termination::kConverged;
  } catch (const nlopt::roundoff_limited&) {
    return Termination::kConverged;  // no further progress is possible in double precision
  } catch (const nlopt::forced_stop&) {
    return Termination::kBudget;
  } catch (const std::exception&) {
    return Termination::kStalled;
  }
}

// One round of a local method from where `projected` begins.
Termination Round(const FitProblem& problem, const SolveOptions& options, nlopt::algorithm algorithm, double damping,
                  Projected* projected) {
  const Whitened whitened(projected->best(), problem.layout().low, problem.layout().high, damping);
  if (!whitened.good() || whitened.size() == 0) return Termination::kConverged;
  const auto n = static_cast<unsigned>(whitened.size());
  nlopt::opt opt(algorithm, n);
  RoundCall call{.projected = projected, .whitened = &whitened};
  const bool gradient = algorithm != nlopt::LN_BOBYQA;
  opt.set_min_objective(CallRound, &call);
  opt.set_lower_bounds(-kPolicy.reach);
  opt.set_upper_bounds(kPolicy.reach);
  opt.set_ftol_rel(kPolicy.tolerance_share * options.tolerance);
  opt.set_maxeval(gradient ? kPolicy.evaluations : kPolicy.evaluations_per_unknown * static_cast<int>(n));
  if (!gradient) opt.set_initial_step(kPolicy.first_step);
  return Optimize(opt, std::vector<double>(n, 0.0));
}

// A round, and what it means for the run.
void Advance(FitProblem& problem, const SolveOptions& options, nlopt::algorithm algorithm, Checkpoint* s) {
  Projected projected(problem, options, s->difference);
  const auto end = [&](Termination termination) { s->done = true, s->termination = termination; };
  if (!projected.Begin(s->point)) return end(Termination::kNotSimulated);
  const Termination round = Round(problem, options, algorithm, s->damping, &projected);
  s->work += projected.work();
  ++s->iterations;
  const Known& best = projected.best();
  const double before = s->cost;
  if (best.cost() < s->cost) s->cost = best.cost(), s->point = best.point;
  if (round == Termination::kBudget) return end(round);
  const bool coarse = s->difference > options.fine_step;
  if (before - s->cost >= (coarse ? kPolicy.coarse_tolerance : 1) * options.tolerance * before) {
    s->damping = std::max(s->damping * kPolicy.shrink, kPolicy.least_damping);
    s->quiet = 0;
    return;
  }
  // What a far step does not find a nearer one may.
  if (++s->quiet < kPolicy.most_quiet) {
    s->damping = std::max(s->damping, kPolicy.first_damping) * kPolicy.grow;
    return;
  }
  s->quiet = 0;
  s->damping = kPolicy.first_damping;
  // Done with this finite difference: the finer one sees the bottom better.
  if (!coarse) return end(Termination::kConverged);
  s->difference = options.fine_step;
}

SolveResult Locally(const SolveTask& task, const FitPoint& start, const SolveOptions& options,
                    nlopt::algorithm algorithm) {
  const Evaluation first = task.objective.Evaluate(start, Keep::kCost);
  Checkpoint s{.point = start,
               .cost = first.cost,
               .damping = kPolicy.first_damping,
               .difference = options.coarse_step,
               .work = first.work};
  if (!std::isfinite(first.cost)) s.done = true, s.termination = Termination::kNotSimulated;
  if (start.y.size() == 0) s.done = true, s.termination = Termination::kConverged;
  while (!s.done && s.iterations < kPolicy.most_rounds) {
    if (std::vector<double> record; task.journal && task.journal->Next(CallAt("iterate", s.point), &record)) {
      Unpack(record, &s);
      continue;
    }
    if (IsLate(options.deadline)) {
      s.termination = Termination::kBudget;
      break;
    }
    const FitPoint before = s.point;
    Advance(task.problem, options, algorithm, &s);
    // A round that the deadline cut short is made anew.
    if (task.journal && !IsLate(options.deadline)) task.journal->Append(CallAt("iterate", before), Pack(s));
  }
  return {.point = s.point, .cost = s.cost, .termination = s.termination, .iterations = s.iterations, .work = s.work};
}

}  // namespace

SolveResult SolveWithNlopt(const SolveTask& task, const FitPoint& start, const SolveOptions& options,
                           const OptimizerRow& row) {
  return Locally(task, start, options, static_cast<nlopt::algorithm>(row.algorithm));
}

SolveResult SearchWithNlopt(const SolveTask& task, const FitPoint& start, const SolveOptions& options,
                            const OptimizerRow& row) {
  const auto n = static_cast<unsigned>(start.y.size());
  const Evaluation first = task.objective.Evaluate(start, Keep::kCost);
  if (n == 0 || !std::isfinite(first.cost)) return Locally(task, start, options, nlopt::LD_SLSQP);
  nlopt::srand(options.seed + 1);
  nlopt::opt opt(static_cast<nlopt::algorithm>(row.algorithm), n);
  SearchCall call{.task = &task,
                  .options = &options,
                  .start = start,
                  .scale = 1 / first.cost,
                  .best = start,
                  .least = first.cost,
                  .work = first.work};
  opt.set_min_objective(CallSearch, &call);
  opt.set_lower_bounds(0.0);
  opt.set_upper_bounds(1.0);
  opt.set_ftol_rel(kPolicy.tolerance_share * options.tolerance);
  opt.set_maxeval(kPolicy.search_unit * options.max_iterations);
  if (row.algorithm == nlopt::G_MLSL_LDS) {
    nlopt::opt local(nlopt::LD_SLSQP, n);
    local.set_ftol_rel(options.tolerance);
    local.set_maxeval(kPolicy.evaluations);
    opt.set_local_optimizer(local);
  }
  const FitLayout& layout = task.problem.layout();
  const Eigen::VectorXd share = (start.y - layout.low).cwiseQuotient(layout.high - layout.low);
  const Termination searched = Optimize(opt, std::vector<double>(share.begin(), share.end()));
  if (searched == Termination::kBudget) {
    const Evaluation there = task.problem.Evaluate(call.best, Keep::kCost);
    const bool better = there.cost < first.cost;
    return {.point = better ? call.best : start,
            .cost = better ? there.cost : first.cost,
            .termination = searched,
            .work = call.work};
  }
  SolveResult polished = Locally(task, call.best, options, nlopt::LD_SLSQP);
  polished.work += call.work;
  return polished;
}

}  // namespace gapscope
