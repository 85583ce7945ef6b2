#include "src/fit/nlopt.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlopt.hpp>

namespace gapscope {
namespace {

struct NloptPolicy {
  int most_rounds = 6;
  int evaluations = 30;             // of a round of a method with gradients
  int evaluations_per_unknown = 8;  // of one without
  double reach = 2;                 // of z: a quadratic cost of one has its bottom at most sqrt(2) away
  double tolerance_share = 0.3;     // of the solve's own, for a round
  double first_step = 0.5;          // of z, of a method without gradients
  double least_diagonal = 1e-12;    // of the largest one: below it a direction is open, and left where it is
  int search_unit = 100;            // evaluations of a global search per iteration that is allowed
  double not_simulated = 1e3;       // times the start's cost
};
constexpr NloptPolicy kPolicy;

// What is known of one point.
struct Known {
  FitPoint point;
  Linearization at;
  double cost = std::numeric_limits<double>::infinity();  // with the states at their optimum
};

// The projected cost F of a problem, evaluation by evaluation. Nothing may be thrown through NLopt's C code but its own
// forced_stop.
class Projected {
 public:
  Projected(const SolveTask& task, const SolveOptions& options) : task_(task), options_(options) {}

  // F at y with gradient and Hessian. States start where the last linearization sends them.
  const Known& Linearized(const Eigen::VectorXd& y) {
    last_.point = last_.at.valid ? Move(task_.problem, last_.point, last_.at, y - last_.point.y)
                                 : FitPoint{.y = y, .states = last_.point.states};
    last_.at = task_.objective.Linearize(last_.point, {.step = options_.fine_step});
    last_.cost = last_.at.valid ? last_.at.reduced_cost : std::numeric_limits<double>::infinity();
    Count(last_.at.work);
    if (!last_.at.valid) {
      last_ = best_;  // states from where the model could be simulated
      refused_.cost = std::numeric_limits<double>::infinity();
      return refused_;
    }
    if (last_.cost < best_.cost) best_ = last_;
    return last_;
  }

  // F at y alone: the states by one Gauss-Newton step from where the last linearization sends them.
  double Cost(const Eigen::VectorXd& y) {
    FitPoint point = last_.at.valid ? Move(task_.problem, last_.point, last_.at, y - last_.point.y)
                                    : FitPoint{.y = y, .states = last_.point.states};
    Work work;
    point = SolveStates(task_.problem, task_.objective, point, 1, &work);
    const Evaluation evaluation = task_.objective.Evaluate(point, Keep::kCost);
    work += evaluation.work;
    Count(work);
    if (evaluation.cost < best_.cost) best_ = {.point = point, .at = {}, .cost = evaluation.cost};
    return evaluation.cost;
  }

  // Makes the Hessian known at the best point, if it is not.
  bool LinearizeBest() {
    if (best_.at.valid) return true;
    last_ = best_;
    const double cost = best_.cost;
    (void)Linearized(best_.point.y);
    if (!best_.at.valid) {
      best_ = last_;
      best_.cost = std::min(cost, last_.cost);
    }
    return best_.at.valid;
  }

  void Start(const FitPoint& start) { last_.point = best_.point = start; }
  const Known& best() const { return best_; }
  const Work& work() const { return work_; }
  int evaluations() const { return evaluations_; }
  bool Late() const { return IsLate(options_.deadline); }

 private:
  void Count(const Work& work) {
    work_ += work;
    ++evaluations_;
    if (options_.progress)
      options_.progress({.best = best_.cost, .evaluations = work_.evaluations, .iteration = evaluations_});
  }

  const SolveTask& task_;
  const SolveOptions& options_;
  Known last_, best_, refused_;
  Work work_;
  int evaluations_ = 0;
};

// Coordinates of one round: y = clamp(y0 + L^-T z), in units where the cost at z = 0 is one and its Hessian the
// identity.
class Whitened {
 public:
  Whitened(const Known& at, const Eigen::VectorXd& low, const Eigen::VectorXd& high)
      : y0_(at.point.y), low_(low), high_(high), scale_(1 / at.cost) {
    const Eigen::MatrixXd& h = at.at.hessian;
    const double least = kPolicy.least_diagonal * h.diagonal().maxCoeff();
    for (Eigen::Index i = 0; i < y0_.size(); ++i) {
      const double edge = 1e-9 * (high[i] - low[i]), slope = at.at.gradient[i];
      const bool held = (y0_[i] <= low[i] + edge && slope > 0) || (y0_[i] >= high[i] - edge && slope < 0);
      if (!held && h(i, i) > least) free_.push_back(i);
    }
    Eigen::MatrixXd own(size(), size());
    for (Eigen::Index a = 0; a < size(); ++a) {
      for (Eigen::Index b = 0; b < size(); ++b) own(a, b) = scale_ * h(Free(a), Free(b));
      own(a, a) *= 1 + 1e-9;
    }
    factor_.compute(own);
  }
  bool good() const { return factor_.info() == Eigen::Success; }
  Eigen::Index size() const { return static_cast<Eigen::Index>(free_.size()); }
  double scale() const { return scale_; }

  Eigen::VectorXd Y(const Eigen::VectorXd& z) const {
    const Eigen::VectorXd moved = factor_.matrixU().solve(z);
    Eigen::VectorXd y = y0_;
    for (Eigen::Index a = 0; a < size(); ++a)
      y[Free(a)] = std::clamp(y0_[Free(a)] + moved[a], low_[Free(a)], high_[Free(a)]);
    return y;
  }
  // Of the scaled cost by z. A coordinate that is held on its bound does not move with z.
  Eigen::VectorXd Gradient(const Eigen::VectorXd& z, const Eigen::VectorXd& gradient) const {
    const Eigen::VectorXd moved = factor_.matrixU().solve(z);
    Eigen::VectorXd own(size());
    for (Eigen::Index a = 0; a < size(); ++a) {
      const double y = y0_[Free(a)] + moved[a];
      own[a] = y < low_[Free(a)] || y > high_[Free(a)] ? 0 : scale_ * gradient[Free(a)];
    }
    return factor_.matrixL().solve(own);
  }

 private:
  Eigen::Index Free(Eigen::Index a) const { return free_[static_cast<std::size_t>(a)]; }

  Eigen::VectorXd y0_;
  const Eigen::VectorXd &low_, &high_;
  double scale_;
  std::vector<Eigen::Index> free_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

// What an NLopt callback is given.
struct Callback {
  Projected* projected;
  const Whitened* whitened;  // null: the argument is y in shares of its range
  const FitProblem* problem;
  double scale;  // of the cost
};

Eigen::VectorXd Point(const Callback& callback, const std::vector<double>& x) {
  const Eigen::VectorXd z = Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(x.size()));
  if (callback.whitened) return callback.whitened->Y(z);
  const FitLayout& layout = callback.problem->layout();
  return layout.low + z.cwiseProduct(layout.high - layout.low);
}

double Callee(const std::vector<double>& x, std::vector<double>& gradient, void* data) {
  const auto* callback = static_cast<Callback*>(data);
  Projected& projected = *callback->projected;
  if (projected.Late()) throw nlopt::forced_stop();  // nlopt's own C++ wrapper catches and remembers it
  const Eigen::VectorXd y = Point(*callback, x);
  if (gradient.empty()) {
    const double cost = callback->scale * projected.Cost(y);
    return std::isfinite(cost) ? cost : kPolicy.not_simulated;
  }
  const Known& known = projected.Linearized(y);
  Eigen::Map<Eigen::VectorXd> out(gradient.data(), static_cast<Eigen::Index>(gradient.size()));
  out.setZero();
  if (!std::isfinite(known.cost)) return kPolicy.not_simulated;
  const Eigen::VectorXd z = Eigen::Map<const Eigen::VectorXd>(x.data(), out.size());
  const FitLayout& layout = callback->problem->layout();
  out = callback->whitened ? callback->whitened->Gradient(z, known.at.gradient)
                           : callback->scale * known.at.gradient.cwiseProduct(layout.high - layout.low).eval();
  return callback->scale * known.cost;
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

// One round of a local method from the best point.
Termination Round(const SolveTask& task, const SolveOptions& options, nlopt::algorithm algorithm,
                  Projected* projected) {
  const Whitened whitened(projected->best(), task.problem.layout().low, task.problem.layout().high);
  if (!whitened.good() || whitened.size() == 0) return Termination::kConverged;
  const auto n = static_cast<unsigned>(whitened.size());
  nlopt::opt opt(algorithm, n);
  Callback callback{.projected = projected, .whitened = &whitened, .problem = &task.problem, .scale = whitened.scale()};
  const bool gradient = algorithm != nlopt::LN_BOBYQA;
  opt.set_min_objective(Callee, &callback);
  opt.set_lower_bounds(-kPolicy.reach);
  opt.set_upper_bounds(kPolicy.reach);
  opt.set_ftol_rel(kPolicy.tolerance_share * options.tolerance);
  opt.set_maxeval(gradient ? kPolicy.evaluations : kPolicy.evaluations_per_unknown * static_cast<int>(n));
  if (!gradient) opt.set_initial_step(kPolicy.first_step);
  return Optimize(opt, std::vector<double>(n, 0.0));
}

// The best point with its states solved, as a result.
SolveResult Finish(const SolveTask& task, const FitPoint& start, double start_cost, Termination termination,
                   const Projected& projected) {
  SolveResult result{.point = start, .cost = start_cost, .termination = termination, .work = projected.work()};
  result.iterations = projected.evaluations();
  if (!std::isfinite(projected.best().cost)) return result;
  const Known& best = projected.best();
  const auto consider = [&](const FitPoint& point) {
    const Evaluation evaluation = task.objective.Evaluate(point, Keep::kCost);
    result.work += evaluation.work;
    if (evaluation.cost < result.cost) result.cost = evaluation.cost, result.point = point;
  };
  consider(best.point);
  if (best.at.valid) consider(Move(task.problem, best.point, best.at, Eigen::VectorXd::Zero(best.point.y.size())));
  return result;
}

SolveResult Locally(const SolveTask& task, const FitPoint& start, const SolveOptions& options,
                    nlopt::algorithm algorithm) {
  const Evaluation first = task.objective.Evaluate(start, Keep::kCost);
  SolveResult unsolved{.point = start, .cost = first.cost, .work = first.work};
  unsolved.termination = std::isfinite(first.cost) ? Termination::kConverged : Termination::kNotSimulated;
  if (!std::isfinite(first.cost) || start.y.size() == 0) return unsolved;
  Projected projected(task, options);
  projected.Start(start);
  if (!IsLate(options.deadline)) (void)projected.Linearized(start.y);
  Termination termination = Termination::kIterations;
  for (int round = 0; round < kPolicy.most_rounds; ++round) {
    if (IsLate(options.deadline)) {
      termination = Termination::kBudget;
      break;
    }
    if (!projected.LinearizeBest()) {
      termination = Termination::kStalled;
      break;
    }
    const double before = projected.best().cost;
    termination = Round(task, options, algorithm, &projected);
    if (termination == Termination::kBudget) break;
    if (before - projected.best().cost < options.tolerance * before) {
      termination = Termination::kConverged;
      break;
    }
  }
  SolveResult result = Finish(task, start, first.cost, termination, projected);
  result.work += first.work;
  return result;
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
  Projected projected(task, options);
  projected.Start(start);
  Callback callback{.projected = &projected, .whitened = nullptr, .problem = &task.problem, .scale = 1 / first.cost};
  opt.set_min_objective(Callee, &callback);
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
  SolveResult found = Finish(task, start, first.cost, searched, projected);
  found.work += first.work;
  if (searched == Termination::kBudget) return found;
  SolveResult polished = Locally(task, found.point, options, nlopt::LD_SLSQP);
  polished.work += found.work;
  polished.iterations += found.iterations;
  if (!(polished.cost <= found.cost)) polished.point = found.point, polished.cost = found.cost;
  return polished;
}

}  // namespace gapscope
