#include "src/fit/normal_equations.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "src/core/collect.h"
#include "src/core/dense.h"
#include "src/core/statistics.h"
#include "src/fit/blocks.h"
#include "src/fit/coupling.h"
#include "src/fit/policy.h"

namespace gapscope {
namespace {

using Columns = DifferenceOptions::Columns;

// The gradient of one half second of a log in the signals of one limb.
struct BlockGradient {
  std::size_t limb = 0;
  long half_second = 0;
  Eigen::VectorXd gradient;
};

// A window's part, with the gradient once more by blocks.
struct Part {
  WindowEquations equations;
  std::vector<BlockGradient> blocks;
};

// Of each signal of a log.
std::vector<std::size_t> LimbsOf(const FitProblem& problem, std::size_t log) {
  const auto& coupling = problem.options().coupling;
  return Collect(problem.recordings()[log].measured,
                 [&](const auto& measured) { return coupling ? coupling->LimbOf(measured.index) : std::size_t{0}; });
}

// Rows less what the states take, at the states' optimum, summed by half second and limb.
std::vector<BlockGradient> BlockGradients(const FitProblem& problem, const FitWindow& window,
                                          const Eigen::VectorXd& residual, const Eigen::MatrixXd& jacobian,
                                          const WindowEquations& equations) {
  const Eigen::Index n = equations.gradient.size(), m = equations.state_step.size();
  Eigen::MatrixXd reduced = jacobian.leftCols(n);
  Eigen::VectorXd after = residual;
  if (m > 0) {
    reduced -= jacobian.rightCols(m) * equations.gain;
    after += jacobian.rightCols(m) * equations.state_step;
  }
  const std::vector<std::size_t> limbs = LimbsOf(problem, window.log);
  std::vector<BlockGradient> blocks;
  for (const RowBlock& rows : RowBlocks(problem.recordings()[window.log], window)) {
    std::map<std::size_t, Eigen::VectorXd> of_limb;
    for (std::size_t s = 0; s < limbs.size(); ++s) {
      const Eigen::Index first = rows.begin + static_cast<Eigen::Index>(s) * window.scored();
      of_limb.try_emplace(limbs[s], Eigen::VectorXd::Zero(n)).first->second +=
          reduced.middleRows(first, rows.count).transpose() * after.segment(first, rows.count);
    }
    for (auto& [limb, gradient] : of_limb) blocks.push_back({limb, rows.half_second, std::move(gradient)});
  }
  return blocks;
}

Part ReducePart(const FitProblem& problem, std::size_t w, const FitPoint& point, const Derivatives& derivatives,
                Blocks with_blocks) {
  const FitWindow& window = problem.windows()[w];
  const Eigen::VectorXd& state = point.states[w];
  const Eigen::Index n = problem.layout().low.size();
  const Eigen::VectorXd* residual = &derivatives.residuals[w];
  const Eigen::MatrixXd* jacobian = &derivatives.jacobians[w];
  Part part;
  if (residual->size() == 0) {
    part.equations.hessian = Eigen::MatrixXd::Zero(n, n);
    part.equations.gain = Eigen::MatrixXd::Zero(state.size(), n);
    part.equations.gradient = Eigen::VectorXd::Zero(n);
    part.equations.state_step = Eigen::VectorXd::Zero(state.size());
    return part;
  }
  Eigen::VectorXd weighed;
  Eigen::MatrixXd weighed_jacobian;
  if (!problem.huber().plain()) {
    weighed = *residual;
    weighed_jacobian = *jacobian;
    problem.huber().Weigh(weighed, weighed_jacobian);
    residual = &weighed;
    jacobian = &weighed_jacobian;
  }
  part.equations = ReduceWindow(*residual, *jacobian, state, window.prior);
  part.equations.cost = problem.WindowCost(w, derivatives.residuals[w], state);
  if (with_blocks == Blocks::kHalfSeconds)
    part.blocks = BlockGradients(problem, window, *residual, *jacobian, part.equations);
  return part;
}

}  // namespace

Eigen::VectorXd StateAnswer(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& prior,
                            const Eigen::VectorXd& slope) {
  const Eigen::Index m = prior.size();
  Eigen::MatrixXd own = jacobian.rightCols(m).transpose() * jacobian.rightCols(m);
  own.diagonal() += prior.cwiseAbs2();
  return Ldlt(own).Solve(slope.tail(m));
}

WindowEquations ReduceWindow(const Eigen::VectorXd& residual, const Eigen::MatrixXd& jacobian,
                             const Eigen::VectorXd& state, const Eigen::VectorXd& prior) {
  const Eigen::Index m = state.size(), n = jacobian.cols() - m;
  WindowEquations part;
  const Eigen::MatrixXd full = jacobian.transpose() * jacobian;
  const Eigen::VectorXd slope = jacobian.transpose() * residual;
  if (m == 0) {
    part.hessian = full;
    part.gradient = slope;
    part.gain.resize(0, n);
    part.state_step.resize(0);
    return part;
  }
  Eigen::MatrixXd own = full.bottomRightCorner(m, m);
  own.diagonal() += prior.cwiseAbs2();
  const Ldlt solver(own);
  const Eigen::VectorXd state_slope = slope.tail(m) + prior.cwiseAbs2().cwiseProduct(state);
  part.gain = solver.Solve(full.bottomLeftCorner(m, n));
  part.state_step = -solver.Solve(state_slope);
  part.state_gain_cost = -0.5 * state_slope.dot(part.state_step);
  part.hessian = full.topLeftCorner(n, n) - full.topRightCorner(n, m) * part.gain;
  part.gradient = slope.head(n) + full.topRightCorner(n, m) * part.state_step;
  return part;
}

Linearization Reduce(const FitProblem& problem, const FitPoint& point, const Derivatives& derivatives,
                     Blocks with_blocks) {
  const Eigen::Index n = problem.layout().low.size();
  const std::size_t count = problem.windows().size();
  Linearization result;
  result.hessian = Eigen::MatrixXd::Zero(n, n);
  result.gradient = Eigen::VectorXd::Zero(n);
  result.valid = derivatives.valid;
  if (!derivatives.valid) return result;
  std::vector<Part> parts(count);
  problem.pool().ForEach(
      count, [&](std::size_t w, int) { parts[w] = ReducePart(problem, w, point, derivatives, with_blocks); });
  std::map<std::tuple<std::size_t, std::size_t, long>, Eigen::VectorXd> blocks;  // by log, limb and half second
  double gained = 0;
  for (std::size_t w = 0; w < count; ++w) {
    WindowEquations& part = parts[w].equations;
    result.cost += part.cost;
    gained += part.state_gain_cost;
    result.hessian += part.hessian;
    result.gradient += part.gradient;
    for (const auto& [limb, half_second, gradient] : parts[w].blocks) {
      const auto [entry, added] = blocks.try_emplace({problem.windows()[w].log, limb, half_second}, gradient);
      if (!added) entry->second += gradient;
    }
    result.state_gain.push_back(std::move(part.gain));
    result.state_step.push_back(std::move(part.state_step));
  }
  std::map<std::pair<std::size_t, std::size_t>, int> series;
  for (auto& [key, block] : blocks) {
    const std::pair log_and_limb{std::get<0>(key), std::get<1>(key)};
    result.block_series.push_back(series.try_emplace(log_and_limb, static_cast<int>(series.size())).first->second);
    result.block_gradients.push_back(std::move(block));
  }
  result.cost += problem.prior().Cost(point.y);
  result.reduced_cost = result.cost - gained;
  result.gradient += problem.prior().Gradient(point.y);
  result.hessian.diagonal() += problem.prior().weight;
  return result;
}

Linearization Linearize(FitProblem& problem, const FitPoint& point, const DifferenceOptions& options) {
  const Derivatives derivatives = problem.Differentiate(point, options);
  Linearization result =
      Reduce(problem, point, derivatives, options.columns == Columns::kCentral ? Blocks::kHalfSeconds : Blocks::kNone);
  result.work = derivatives.work;
  return result;
}

FitPoint Move(const FitProblem& problem, const FitPoint& point, const Linearization& at, const Eigen::VectorXd& dy) {
  FitPoint moved{.y = (point.y + dy).cwiseMax(problem.layout().low).cwiseMin(problem.layout().high),
                 .states = point.states};
  const Eigen::VectorXd taken = moved.y - point.y;
  for (std::size_t w = 0; w < moved.states.size(); ++w) {
    if (moved.states[w].size() > 0) moved.states[w] += at.state_step[w] - at.state_gain[w] * taken;
  }
  return moved;
}

void UpdateSecant(const FitProblem& problem, Derivatives& derivatives, const FitPoint& from, const FitPoint& to,
                  Residuals residuals) {
  const Eigen::VectorXd dy = to.y - from.y;
  problem.pool().ForEach(problem.windows().size(), [&](std::size_t w, int) {
    Eigen::MatrixXd& jacobian = derivatives.jacobians[w];
    Eigen::VectorXd moved(jacobian.cols());
    moved << dy, to.states[w] - from.states[w];
    // In the metric of the columns, so that coordinates of different units share the blame by their effect.
    Eigen::VectorXd weighted = moved.cwiseProduct(jacobian.colwise().squaredNorm().transpose());
    const double length = weighted.dot(moved);
    if (length > 0)
      jacobian += (residuals[w] - derivatives.residuals[w] - jacobian * moved) * (weighted / length).transpose();
    derivatives.residuals[w] = std::move(residuals[w]);
  });
}

Linearization Bend(const FitProblem& problem, const Linearization& at, const Derivatives& derivatives,
                   const FitPoint& from, const FitPoint& to, const Probe& probe) {
  const Eigen::Index n = problem.layout().low.size();
  const Eigen::VectorXd dy = to.y - from.y;
  std::vector<Eigen::VectorXd> gradients(problem.windows().size());
  Linearization bend{.cost = at.cost,
                     .hessian = at.hessian,
                     .gradient = Eigen::VectorXd::Zero(n),
                     .block_gradients = {},
                     .block_series = {},
                     .state_gain = at.state_gain,
                     .state_step = at.state_step,
                     .valid = true,
                     .work = {}};
  problem.pool().ForEach(problem.windows().size(), [&](std::size_t w, int) {
    const Eigen::MatrixXd& jacobian = derivatives.jacobians[w];
    Eigen::VectorXd moved(jacobian.cols());
    moved << dy, to.states[w] - from.states[w];
    // r(x + s v) = r + s J v + s^2/2 r_vv; of r_vv, the half that a step takes.
    const Eigen::VectorXd half =
        ((probe.residuals[w] - derivatives.base()[w]) / probe.share - jacobian * moved) / probe.share;
    const Eigen::VectorXd slope = jacobian.transpose() * half;
    gradients[w] = slope.head(n);
    if (const Eigen::Index m = jacobian.cols() - n; m > 0) {
      bend.state_step[w] = -StateAnswer(jacobian, problem.windows()[w].prior, slope);
      gradients[w] -= at.state_gain[w].transpose() * slope.tail(m);
    }
  });
  for (const auto& gradient : gradients) bend.gradient += gradient;
  return bend;
}

double TakeBetterStates(const FitProblem& problem, FitPoint& point, Residuals& residuals, const FitPoint& other,
                        Residuals& others) {
  double total = problem.prior().Cost(point.y);
  for (std::size_t w = 0; w < problem.windows().size(); ++w) {
    const auto cost = [&](const FitPoint& at, const Residuals& of) {
      return of[w].size() > 0 ? problem.WindowCost(w, of[w], at.states[w]) : kInfinity;
    };
    const double here = cost(point, residuals), there = cost(other, others);
    if (there < here) {
      point.states[w] = other.states[w];
      residuals[w] = std::move(others[w]);
    }
    total += std::min(here, there);
  }
  return total;
}

double ShortenStates(FitProblem& problem, const std::vector<Eigen::VectorXd>& states, FitPoint& point,
                     Residuals& residuals, Work* work) {
  const std::vector<Eigen::VectorXd> whole = point.states;
  WindowMask worse;  // all, then those that the whole step costs more than none
  double cost = kInfinity;
  for (const double share : kFitPolicy.state_shares) {
    FitPoint shorter{.y = point.y, .states = states};
    for (std::size_t w = 0; w < whole.size(); ++w) shorter.states[w] += share * (whole[w] - states[w]);
    Evaluation there = problem.Evaluate(shorter, Keep::kResiduals, worse);
    *work += there.work;
    cost = TakeBetterStates(problem, point, residuals, shorter, there.residuals);
    if (!worse.empty()) continue;
    for (std::size_t w = 0; w < whole.size(); ++w) worse.push_back(static_cast<char>(point.states[w] != whole[w]));
    if (std::ranges::find(worse, 1) == worse.end()) break;
  }
  return cost;
}

Eigen::VectorXd BoundedStep(const Eigen::MatrixXd& hessian, const Eigen::VectorXd& gradient, const Eigen::VectorXd& y,
                            const Eigen::VectorXd& low, const Eigen::VectorXd& high) {
  const Eigen::Index n = y.size();
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
      const Eigen::Index i = free[static_cast<std::size_t>(a)];
      g[a] = -gradient[i];
      for (Eigen::Index j = 0; j < n; ++j) {
        if (fixed[static_cast<std::size_t>(j)]) g[a] -= hessian(i, j) * step[j];
      }
      for (Eigen::Index b = 0; b < k; ++b) h(a, b) = hessian(i, free[static_cast<std::size_t>(b)]);
    }
    const Eigen::VectorXd solution = Ldlt(h).Solve(g);
    bool again = false;
    for (Eigen::Index a = 0; a < k; ++a) {
      const Eigen::Index i = free[static_cast<std::size_t>(a)];
      const double target = y[i] + solution[a];
      const bool good = std::isfinite(solution[a]);
      step[i] = good ? std::clamp(target, low[i], high[i]) - y[i] : 0;
      if (!good || target < low[i] || target > high[i]) fixed[static_cast<std::size_t>(i)] = 1, again = true;
    }
    if (!again) break;
  }
  return step;
}

}  // namespace gapscope
