#include "src/fit/gram.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "src/core/collect.h"
#include "src/core/dense.h"
#include "src/fit/blocks.h"
#include "src/fit/coupling.h"
#include "src/fit/window_columns.h"

namespace gapscope {
namespace {

// What the residuals at a point have beyond `base`; none: it cannot be simulated.
std::optional<Residuals> Added(FitProblem& problem, const FitPoint& point, const Residuals& base,
                               const WindowMask& mask, StepKind steps, Work* work) {
  Evaluation there = problem.Evaluate(point, Keep::kResiduals, mask, steps);
  *work += there.work;
  if (!std::isfinite(there.cost)) return std::nullopt;
  for (std::size_t w = 0; w < base.size(); ++w) there.residuals[w] -= base[w];
  return std::move(there.residuals);
}

// Makes columns at a point, those in one replay that may share it; of some windows, the others have none.
class ExtraColumns {
 public:
  ExtraColumns(const FitProblem& parent, const FitPoint& point, const Derivatives& at, const WindowMask& mask,
               Work* work)
      : parent_(parent), point_(point), at_(at), mask_(mask), work_(*work) {}

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
      added = Added(child, there, at_.base(), mask_, StepKind::kQuick, &work_);
    if (!added) added = Added(child, there, at_.residuals, mask_, StepKind::kOwn, &work_);
    child.SetProbes({});
    return added;
  }
  // Zero on the other signals.
  Residuals Own(Residuals added, const MovedSignals& moved) const {
    for (std::size_t w = 0; w < added.size(); ++w) {
      if (!mask_[w]) continue;
      const FitWindow& window = parent_.windows()[w];
      KeepMoved(parent_.recordings()[window.log], window, moved, added[w]);
    }
    return added;
  }

  const FitProblem& parent_;
  const FitPoint& point_;
  const Derivatives& at_;
  const WindowMask& mask_;
  Work& work_;
  const ExtraColumn* last_ = nullptr;
  std::optional<Residuals> together_;
};

// Rows of a window's columns that belong to a part.
struct PartRows {
  std::size_t window = 0;
  Eigen::Index begin = 0, count = 0;
  double weight = 1;
};

Eigen::Index ResidualRows(const FitProblem& problem, std::size_t w) {
  const FitWindow& window = problem.windows()[w];
  return window.scored() * static_cast<Eigen::Index>(problem.recordings()[window.log].measured.size());
}

// The signal whose joint starts in a state; where none does, the number of signals.
std::size_t SignalOfState(const std::vector<SignalLayout>& signals, Eigen::Index state) {
  const auto found = std::ranges::find_if(signals, [&](const SignalLayout& signal) {
    return signal.joint_state >= 0 && (state == signal.joint_state || state == signal.joint_state + 1);
  });
  return static_cast<std::size_t>(found - signals.begin());
}

// Which rows belong to which part.
std::vector<std::vector<PartRows>> RowsOfParts(const FitProblem& problem, const GramParts& parts,
                                               std::size_t* half_seconds) {
  std::vector<std::vector<PartRows>> rows(parts.count);
  std::set<std::pair<std::size_t, long>> seen;
  // By log, its signals and all of them, and part.
  std::vector<std::vector<std::vector<double>>> counts;
  for (const Recording& log : problem.recordings())
    counts.emplace_back(log.measured.size() + 1, std::vector<double>(parts.count, 0.0));
  for (std::size_t w = 0; w < problem.windows().size(); ++w) {
    const FitWindow& window = problem.windows()[w];
    const auto& measured = problem.recordings()[window.log].measured;
    for (const RowBlock& block : RowBlocks(problem.recordings()[window.log], window)) {
      seen.insert({window.log, block.half_second});
      for (std::size_t s = 0; s < measured.size(); ++s) {
        const std::size_t part = parts.of(window.log, block.half_second, measured[s].index);
        for (const std::size_t of : {s, measured.size()})
          counts[window.log][of][part] += static_cast<double>(block.count);
        const Eigen::Index first = static_cast<Eigen::Index>(s) * window.scored();
        rows[part].push_back({.window = w, .begin = first + block.begin, .count = block.count});
      }
    }
  }
  *half_seconds = seen.size();
  for (std::size_t w = 0; w < problem.windows().size(); ++w) {
    const FitWindow& window = problem.windows()[w];
    for (Eigen::Index state = 0; state < window.prior.size(); ++state) {
      const auto& of = counts[window.log][SignalOfState(problem.layout().signals[window.log], state)];
      const double all = std::accumulate(of.begin(), of.end(), 0.0);
      for (std::size_t part = 0; part < parts.count; ++part) {
        if (of[part] > 0) rows[part].push_back({w, ResidualRows(problem, w) + state, 1, of[part] / all});
      }
    }
  }
  return rows;
}

// Windows in turn whose columns are together no more than a quarter of a gigabyte, or one window.
std::vector<WindowMask> Batches(const FitProblem& problem, Eigen::Index columns) {
  constexpr Eigen::Index kNumbers = 32 << 20;
  std::vector<WindowMask> batches;
  Eigen::Index numbers = kNumbers;
  for (std::size_t w = 0; w < problem.windows().size(); ++w) {
    const Eigen::Index own = ResidualRows(problem, w) * columns;
    if (numbers + own > kNumbers) {
      batches.emplace_back(problem.windows().size(), static_cast<char>(false));
      numbers = 0;
    }
    numbers += own;
    batches.back()[w] = static_cast<char>(true);
  }
  return batches;
}

// Adds weighted products of the rows that are there: the lower half stripe by stripe, so that the sums are the same on
// any number of workers, and no worker holds a matrix of its own.
void AddProducts(const FitProblem& problem, const std::vector<WindowColumns>& windows,
                 const std::vector<PartRows>& part, Eigen::MatrixXd* products) {
  constexpr Eigen::Index kStripe = 64;
  const Eigen::Index size = products->cols();
  problem.pool().ForEach(static_cast<std::size_t>((size + kStripe - 1) / kStripe), [&](std::size_t k, int) {
    const Eigen::Index first = static_cast<Eigen::Index>(k) * kStripe, width = std::min(kStripe, size - first);
    std::vector<double> scratch;
    for (const PartRows& of : part) {
      if (windows[of.window].empty()) continue;
      windows[of.window].AddProducts(of.begin, of.count, of.weight, {first, width}, products, &scratch);
    }
  });
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

namespace {

// The columns of some windows, none of the others; nothing: they cannot be simulated at the point.
std::optional<std::vector<WindowColumns>> ColumnsOf(FitProblem& parent, const FitPoint& point,
                                                    std::span<const ExtraColumn> extra,
                                                    const DifferenceOptions& options, const std::atomic<bool>* stop,
                                                    GramSystem* gram) {
  Derivatives at = parent.Differentiate(point, options);
  gram->work += at.work;
  if (!at.valid) return std::nullopt;
  std::vector<WindowColumns> windows(parent.windows().size());
  for (std::size_t w = 0; w < windows.size(); ++w) {
    if (!options.mask[w]) continue;
    windows[w].Begin(at.residuals[w], at.jacobians[w], parent.windows()[w], point.states[w],
                     static_cast<Eigen::Index>(gram->columns.size()));
    at.jacobians[w] = {};
  }
  ExtraColumns columns(parent, point, at, options.mask, &gram->work);
  for (std::size_t e = 0; e < extra.size(); ++e) {
    if (stop && stop->load()) return std::nullopt;
    const std::optional<Residuals> added = columns.Make(extra[e]);
    if (!added) gram->failed[e] = static_cast<char>(true);
    for (std::size_t w = 0; w < windows.size() && added; ++w) {
      if (options.mask[w]) windows[w].Set(gram->parameters + static_cast<Eigen::Index>(e), (*added)[w]);
    }
  }
  parent.pool().ForEach(windows.size(), [&](std::size_t w, int) {
    if (options.mask[w]) windows[w].Finish(parent.huber());
  });
  return windows;
}

}  // namespace

GramSystem MakeGram(FitProblem& parent, const FitPoint& point, std::span<const ExtraColumn> extra,
                    const DifferenceOptions& options, const GramParts& parts, const std::atomic<bool>* stop) {
  GramSystem gram{.columns = ColumnNames(parent, extra),
                  .parameters = parent.layout().low.size(),
                  .failed = std::vector<char>(extra.size(), static_cast<char>(false))};
  const auto size = static_cast<Eigen::Index>(gram.columns.size());
  const auto rows = RowsOfParts(parent, parts, &gram.half_seconds);
  gram.parts.assign(parts.count, Eigen::MatrixXd::Zero(size, size));
  DifferenceOptions of_batch = options;
  for (WindowMask& batch : Batches(parent, size)) {
    of_batch.mask = std::move(batch);
    const auto windows = ColumnsOf(parent, point, extra, of_batch, stop, &gram);
    if (!windows) return gram;
    for (std::size_t p = 0; p < parts.count; ++p) AddProducts(parent, *windows, rows[p], &gram.parts[p]);
  }
  for (Eigen::MatrixXd& products : gram.parts) {
    for (std::size_t e = 0; e < extra.size(); ++e) {
      const Eigen::Index column = gram.parameters + static_cast<Eigen::Index>(e);
      if (gram.failed[e]) products.row(column).setZero(), products.col(column).setZero();
    }
    products.triangularView<Eigen::StrictlyUpper>() = products.transpose();
  }
  gram.valid = true;
  return gram;
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
