#include "src/fit/gram.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <set>

#include "src/core/collect.h"
#include "src/core/dense.h"
#include "src/fit/blocks.h"
#include "src/fit/coupling.h"

namespace gapscope {
namespace {

// A window's columns with its state taken out of them, and the rows of its prior after that.
struct StateFree {
  Eigen::MatrixXd rows, prior;
};

StateFree TakeStateOut(const Eigen::MatrixXd& columns, const Eigen::MatrixXd& states, const Eigen::VectorXd& prior,
                       const Eigen::VectorXd& state) {
  const Eigen::Index rows = columns.rows(), m = prior.size();
  if (m == 0) return {.rows = columns, .prior = Eigen::MatrixXd(0, columns.cols())};
  Eigen::MatrixXd basis(rows + m, m), all = Eigen::MatrixXd::Zero(rows + m, columns.cols());
  basis.topRows(rows) = states;
  basis.bottomRows(m) = prior.asDiagonal();
  all.topRows(rows) = columns;
  all.rightCols(1).bottomRows(m) = prior.cwiseProduct(state);
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(basis);
  all.applyOnTheLeft(qr.householderQ().adjoint());
  all.topRows(m).setZero();
  all.applyOnTheLeft(qr.householderQ());
  return {.rows = all.topRows(rows), .prior = all.bottomRows(m)};
}

// Columns [y | extra | residual] of one window, with robust weights. `extra`: what they add to the residuals.
StateFree WindowColumns(const FitProblem& problem, std::size_t w, const FitPoint& point, const Derivatives& at,
                        const std::vector<Residuals>& extra) {
  const Eigen::Index n = problem.layout().low.size(), m = point.states[w].size();
  Eigen::VectorXd residual = at.residuals[w];
  const auto k = static_cast<Eigen::Index>(extra.size());
  Eigen::MatrixXd columns(residual.size(), n + m + k);
  columns.leftCols(n) = at.jacobians[w].leftCols(n);
  columns.rightCols(m) = at.jacobians[w].rightCols(m);
  for (Eigen::Index e = 0; e < k; ++e) columns.col(n + e) = extra[static_cast<std::size_t>(e)][w];
  problem.huber().Weigh(residual, columns);
  Eigen::MatrixXd wanted(residual.size(), n + k + 1);
  wanted << columns.leftCols(n + k), residual;
  return TakeStateOut(wanted, columns.rightCols(m), problem.windows()[w].prior, point.states[w]);
}

// What the residuals at a point have beyond `base`; none: it cannot be simulated.
std::optional<Residuals> Added(FitProblem& problem, const FitPoint& point, const Residuals& base, StepKind steps,
                               Work* work) {
  Evaluation there = problem.Evaluate(point, Keep::kResiduals, {}, steps);
  *work += there.work;
  if (!std::isfinite(there.cost)) return std::nullopt;
  for (std::size_t w = 0; w < base.size(); ++w) there.residuals[w] -= base[w];
  return std::move(there.residuals);
}

// Makes columns at a point, those in one replay that may share it.
class ExtraColumns {
 public:
  ExtraColumns(const FitProblem& parent, const FitPoint& point, const Derivatives& at, Work* work)
      : parent_(parent), point_(point), at_(at), work_(*work) {}

  // What the column adds to the residuals; none: it cannot be simulated.
  std::optional<Residuals> Make(const ExtraColumn& column) {
    if (!last_ || last_->child != column.child || last_->values != column.values || last_->probes != column.probes) {
      together_ = Replay(*column.child, column.values, column.probes);
      last_ = &column;
    }
    if (!together_ && !column.moved.empty()) return Replay(*column.child, column.own_values, column.own_probes);
    if (!together_ || column.moved.empty()) return together_;
    return Own(*together_, column.moved);
  }

 private:
  std::optional<Residuals> Replay(FitProblem& child, const std::vector<double>& values,
                                  const std::vector<ProbeTorque>& probes) {
    const FitPoint there = CarryOver(parent_, point_, child, values);
    child.SetProbes(probes);
    std::optional<Residuals> added;
    if (at_.steps() == StepKind::kQuick && child.model().HasQuickSteps())
      added = Added(child, there, at_.base(), StepKind::kQuick, &work_);
    if (!added) added = Added(child, there, at_.residuals, StepKind::kOwn, &work_);
    child.SetProbes({});
    return added;
  }
  // Zero on the other signals.
  Residuals Own(Residuals added, const MovedSignals& moved) const {
    for (std::size_t w = 0; w < added.size(); ++w) {
      const FitWindow& window = parent_.windows()[w];
      KeepMoved(parent_.recordings()[window.log], window, moved, added[w]);
    }
    return added;
  }

  const FitProblem& parent_;
  const FitPoint& point_;
  const Derivatives& at_;
  Work& work_;
  const ExtraColumn* last_ = nullptr;
  std::optional<Residuals> together_;
};

Residuals Zero(const Residuals& like) {
  return Collect(like, [](const Eigen::VectorXd& of) { return Eigen::VectorXd(Eigen::VectorXd::Zero(of.size())); });
}

// Scored rows of a window that belong to a part.
struct PartRows {
  std::size_t window = 0;
  RowBlock rows;
};

// Products of the part's rows, of all signals: the lower half stripe by stripe, so that the sums are the same on any
// number of workers, and no worker holds a matrix of its own.
Eigen::MatrixXd Products(const FitProblem& problem, const std::vector<StateFree>& columns,
                         const std::vector<PartRows>& part) {
  constexpr Eigen::Index kStripe = 64;
  const Eigen::Index size = columns.front().rows.cols();
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(size, size);
  problem.pool().ForEach(static_cast<std::size_t>((size + kStripe - 1) / kStripe), [&](std::size_t k, int) {
    const Eigen::Index first = static_cast<Eigen::Index>(k) * kStripe, width = std::min(kStripe, size - first);
    for (const auto& [window, block] : part) {
      const Eigen::MatrixXd& all = columns[window].rows;
      for (Eigen::Index row = block.begin; row < all.rows(); row += problem.windows()[window].scored()) {
        const auto rows = all.middleRows(row, block.count);
        products.block(first, first, size - first, width).noalias() +=
            rows.rightCols(size - first).transpose() * rows.middleCols(first, width);
      }
    }
  });
  return products.selfadjointView<Eigen::Lower>();
}

}  // namespace

std::vector<std::string> ColumnNames(const FitProblem& problem, std::span<const ExtraColumn> extra) {
  std::vector<std::string> names(static_cast<std::size_t>(problem.layout().low.size()));
  for (std::size_t i = 0; i < problem.space().coordinates().size(); ++i)
    names[i] = problem.space().parameter(problem.space().coordinates()[i]).name;
  const auto& signals = problem.layout().signals;
  for (std::size_t l = 0; l < signals.size(); ++l) {
    for (std::size_t s = 0; s < signals[l].size(); ++s) {
      if (signals[l][s].offset < 0) continue;
      names[static_cast<std::size_t>(signals[l][s].offset)] =
          "offset " + problem.recordings()[l].measured[s].spec.signal + " log " + std::to_string(l);
    }
  }
  const FitLayout& layout = problem.layout();
  if (layout.command_shift >= 0) names[static_cast<std::size_t>(layout.command_shift)] = "command shift";
  if (layout.force_shift >= 0) names[static_cast<std::size_t>(layout.force_shift)] = "force shift";
  for (const auto& column : extra) names.push_back(column.name);
  names.emplace_back("residual");
  return names;
}

GramSystem MakeGram(FitProblem& parent, const FitPoint& point, std::span<const ExtraColumn> extra,
                    const DifferenceOptions& options, const std::function<long(long)>& part_of) {
  GramSystem gram{.columns = ColumnNames(parent, extra), .parameters = parent.layout().low.size()};
  const Derivatives at = parent.Differentiate(point, options);
  gram.work = at.work;
  if (!at.valid) return gram;
  ExtraColumns columns(parent, point, at, &gram.work);
  std::vector<Residuals> others;
  for (const ExtraColumn& column : extra) {
    std::optional<Residuals> added = columns.Make(column);
    gram.failed.push_back(static_cast<char>(!added));
    others.push_back(added ? *std::move(added) : Zero(at.residuals));
  }
  const std::size_t count = parent.windows().size();
  std::vector<StateFree> state_free(count);
  parent.pool().ForEach(count,
                        [&](std::size_t w, int) { state_free[w] = WindowColumns(parent, w, point, at, others); });
  const auto size = static_cast<Eigen::Index>(gram.columns.size());
  gram.of_priors.assign(parent.recordings().size(), Eigen::MatrixXd::Zero(size, size));
  std::map<std::pair<std::size_t, long>, std::vector<PartRows>> parts;
  std::set<std::pair<std::size_t, long>> half_seconds;
  for (std::size_t w = 0; w < count; ++w) {
    const FitWindow& window = parent.windows()[w];
    gram.of_priors[window.log].noalias() += state_free[w].prior.transpose() * state_free[w].prior;
    for (const RowBlock& block : RowBlocks(parent.recordings()[window.log], window)) {
      half_seconds.insert({window.log, block.half_second});
      parts[{window.log, part_of ? part_of(block.half_second) : 0}].push_back({w, block});
    }
  }
  gram.half_seconds = half_seconds.size();
  for (const auto& [key, rows] : parts) {
    GramPart part{.log = key.first, .number = key.second, .products = Products(parent, state_free, rows)};
    for (const PartRows& of : rows)
      part.rows += static_cast<std::size_t>(of.rows.count) * parent.recordings()[part.log].measured.size();
    gram.parts.push_back(std::move(part));
  }
  gram.valid = true;
  return gram;
}

Eigen::MatrixXd Sum(const GramSystem& gram, std::span<const double> weights) {
  GS_CHECK(weights.empty() || weights.size() == gram.parts.size());
  const auto size = static_cast<Eigen::Index>(gram.columns.size());
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(size, size);
  std::vector<double> weight_of_log(gram.of_priors.size(), 0.0), rows_of_log(gram.of_priors.size(), 0.0);
  for (std::size_t b = 0; b < gram.parts.size(); ++b) {
    const GramPart& part = gram.parts[b];
    const double weight = weights.empty() ? 1 : weights[b];
    sum += weight * part.products;
    weight_of_log[part.log] += weight * static_cast<double>(part.rows);
    rows_of_log[part.log] += static_cast<double>(part.rows);
  }
  for (std::size_t l = 0; l < gram.of_priors.size(); ++l) {
    if (rows_of_log[l] > 0) sum += weight_of_log[l] / rows_of_log[l] * gram.of_priors[l];
  }
  return sum;
}

ColumnBounds BoundsAt(const FitProblem& parent, const FitPoint& point, const GramSystem& gram, double most_extra) {
  const auto columns = static_cast<Eigen::Index>(gram.columns.size()) - 1, n = gram.parameters;
  ColumnBounds bounds{.low = Eigen::VectorXd::Zero(columns),
                      .high = Eigen::VectorXd::Constant(columns, most_extra),
                      .prior_weight = Eigen::VectorXd::Zero(columns),
                      .prior_gone = Eigen::VectorXd::Zero(columns)};
  bounds.low.head(n) = parent.layout().low - point.y;
  bounds.high.head(n) = parent.layout().high - point.y;
  bounds.prior_weight.head(n) = parent.prior().weight;
  bounds.prior_gone.head(n) = point.y - parent.prior().centre;
  return bounds;
}

namespace {

// The set's own equations: hessian and gradient at zero, with the prior.
struct Subset {
  Eigen::MatrixXd hessian;
  Eigen::VectorXd gradient, low, high;
};

Subset Take(const Eigen::MatrixXd& sum, std::span<const Eigen::Index> set, const ColumnBounds& bounds,
            Eigen::Index target) {
  const auto k = static_cast<Eigen::Index>(set.size());
  Subset subset{Eigen::MatrixXd(k, k), Eigen::VectorXd(k), Eigen::VectorXd(k), Eigen::VectorXd(k)};
  for (Eigen::Index a = 0; a < k; ++a) {
    const Eigen::Index i = set[static_cast<std::size_t>(a)];
    for (Eigen::Index b = 0; b < k; ++b) subset.hessian(a, b) = sum(i, set[static_cast<std::size_t>(b)]);
    subset.hessian(a, a) += bounds.prior_weight[i];
    subset.gradient[a] = sum(i, target);
    subset.low[a] = bounds.low[i];
    subset.high[a] = bounds.high[i];
  }
  return subset;
}

// The bounded minimum by an active set: coordinates are put on bounds that they would pass, and let go again where the
// slope there points inside (Nocedal and Wright, Numerical Optimization, 2006, sec. 16.5, for a convex cost).
Eigen::VectorXd Minimise(const Subset& s, std::vector<Eigen::Index>* at_bound) {
  const Eigen::Index k = s.gradient.size();
  Eigen::VectorXd c = Eigen::VectorXd::Zero(k).cwiseMax(s.low).cwiseMin(s.high);
  std::vector<int> held(static_cast<std::size_t>(k), 0);  // -1, 1: on the lower, upper bound
  for (Eigen::Index round = 0; round < 4 * k + 4; ++round) {
    std::vector<Eigen::Index> free;
    for (Eigen::Index i = 0; i < k; ++i) {
      if (!held[static_cast<std::size_t>(i)]) free.push_back(i);
    }
    const auto f = static_cast<Eigen::Index>(free.size());
    const Eigen::VectorXd slope = s.gradient + s.hessian * c;
    Eigen::MatrixXd own(f, f);
    Eigen::VectorXd down(f);
    for (Eigen::Index a = 0; a < f; ++a) {
      for (Eigen::Index b = 0; b < f; ++b)
        own(a, b) = s.hessian(free[static_cast<std::size_t>(a)], free[static_cast<std::size_t>(b)]);
      own(a, a) *= 1 + 1e-12;
      down[a] = -slope[free[static_cast<std::size_t>(a)]];
    }
    const Eigen::VectorXd step = f > 0 ? Ldlt(own).Solve(down) : Eigen::VectorXd();
    // As far along the step as no bound is passed.
    double share = 1;
    Eigen::Index stops = -1;
    for (Eigen::Index a = 0; a < f; ++a) {
      const Eigen::Index i = free[static_cast<std::size_t>(a)];
      if (!std::isfinite(step[a])) return c;
      const double room = step[a] > 0 ? s.high[i] - c[i] : s.low[i] - c[i];
      if (step[a] != 0 && room / step[a] < share) share = std::max(0.0, room / step[a]), stops = i;
    }
    for (Eigen::Index a = 0; a < f; ++a) c[free[static_cast<std::size_t>(a)]] += share * step[a];
    if (stops >= 0) {
      const bool high = s.high[stops] - c[stops] < c[stops] - s.low[stops];
      c[stops] = high ? s.high[stops] : s.low[stops];
      held[static_cast<std::size_t>(stops)] = high ? 1 : -1;
      continue;
    }
    // At the minimum of the free ones: the held one that pulls inside the most is let go.
    const Eigen::VectorXd final = s.gradient + s.hessian * c;
    Eigen::Index freed = -1;
    double most = 1e-12 * (1 + s.gradient.cwiseAbs().maxCoeff());
    for (Eigen::Index i = 0; i < k; ++i) {
      const double pull = held[static_cast<std::size_t>(i)] * final[i];
      if (pull > most) most = pull, freed = i;
    }
    if (freed < 0) break;
    held[static_cast<std::size_t>(freed)] = 0;
  }
  for (Eigen::Index i = 0; i < k; ++i) {
    if (held[static_cast<std::size_t>(i)] && at_bound) at_bound->push_back(i);
  }
  return c;
}

}  // namespace

BoundedSolution SolveBounded(const Eigen::MatrixXd& sum, std::span<const Eigen::Index> set,
                             const ColumnBounds& bounds) {
  const Eigen::Index residual = sum.cols() - 1;
  Subset subset = Take(sum, set, bounds, residual);
  double constant = 0.5 * sum(residual, residual);
  for (std::size_t a = 0; a < set.size(); ++a) {
    const Eigen::Index i = set[a];
    subset.gradient[static_cast<Eigen::Index>(a)] += bounds.prior_weight[i] * bounds.prior_gone[i];
  }
  constant += 0.5 * bounds.prior_weight.cwiseProduct(bounds.prior_gone.cwiseAbs2()).sum();
  BoundedSolution solution{.values = Eigen::VectorXd::Zero(residual)};
  if (set.empty()) {
    solution.cost = constant;
    return solution;
  }
  std::vector<Eigen::Index> held;
  const Eigen::VectorXd c = Minimise(subset, &held);
  for (std::size_t a = 0; a < set.size(); ++a) solution.values[set[a]] = c[static_cast<Eigen::Index>(a)];
  for (const Eigen::Index a : held) solution.at_bound.push_back(set[static_cast<std::size_t>(a)]);
  solution.cost = constant + subset.gradient.dot(c) + 0.5 * c.dot(subset.hessian * c);
  return solution;
}

double Absorbed(const Eigen::MatrixXd& sum, std::span<const Eigen::Index> set, const ColumnBounds& bounds,
                Eigen::Index column) {
  const double own = sum(column, column);
  if (!(own > 0)) return 1;
  if (set.empty()) return 0;
  const Subset subset = Take(sum, set, bounds, column);
  return std::clamp(subset.gradient.dot(Ldlt(subset.hessian).Solve(subset.gradient)) / own, 0.0, 1.0);
}

}  // namespace gapscope
