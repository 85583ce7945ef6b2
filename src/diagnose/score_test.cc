#include "src/diagnose/score_test.h"

#include <algorithm>
#include <cmath>

#include "src/core/dense.h"
#include "src/fit/policy.h"

namespace gapscope {
namespace {

// The solution of hessian x = right, with the fixed coordinates held at zero.
Eigen::VectorXd SolveFree(Eigen::MatrixXd hessian, Eigen::VectorXd right, const std::vector<char>& fixed) {
  for (Eigen::Index i = 0; i < right.size(); ++i) {
    if (!fixed[static_cast<std::size_t>(i)]) continue;
    hessian.row(i).setZero();
    hessian.col(i).setZero();
    hessian(i, i) = 1;
    right[i] = 0;
  }
  return Ldlt(hessian).Solve(right);
}

// A column's products with the residual, itself and y, the states taken out; raw: its own square before that.
struct TrialColumn {
  Eigen::VectorXd cross;
  double square = 0, slope = 0, raw = 0;
};

TrialColumn WindowColumn(const Eigen::VectorXd& residual, const FitWindow& window, std::size_t w,
                         const Snapshot& base) {
  const Eigen::VectorXd column = residual - base.derivatives.residuals[w];
  const Eigen::MatrixXd& jacobian = base.derivatives.jacobians[w];
  const Eigen::Index n = base.linearization.gradient.size(), m = jacobian.cols() - n;
  const Eigen::VectorXd all = jacobian.transpose() * column;
  TrialColumn part;
  part.raw = part.square = column.squaredNorm();
  part.slope = column.dot(base.derivatives.residuals[w]);
  part.cross = all.head(n);
  if (m > 0) {
    // The states' own answer: with gain = S^-1 Jx' Jy and step = -S^-1 Jx' r, S^-1 Jx' c needs S once more.
    const Eigen::VectorXd answer = StateAnswer(jacobian, window.prior, all);
    part.square -= all.tail(m).dot(answer);
    part.slope += all.tail(m).dot(base.linearization.state_step[w]);
    part.cross -= base.linearization.state_gain[w].transpose() * all.tail(m);
  }
  return part;
}

// The best scale of a column, y answering it. A coordinate on its bound cannot go further: the nuisance shift of a
// command that is later than one sample. Those that push outward already are held; one that the column would pull back
// inside is let go, one that it would push out is held too.
ColumnTest BestScale(const TrialColumn& column, const FitProblem& parent, const FitPoint& parent_point,
                     const Linearization& at) {
  ColumnTest test{.valid = true};
  const Eigen::Index n = at.gradient.size();
  std::vector<int> bound(static_cast<std::size_t>(n), 0);  // 1: on its upper bound, -1: on its lower one
  std::vector<char> fixed(static_cast<std::size_t>(n), 0);
  const FitLayout& layout = parent.layout();
  for (Eigen::Index i = 0; i < n; ++i) {
    const double edge = 1e-6 * (layout.high[i] - layout.low[i]);
    const auto k = static_cast<std::size_t>(i);
    bound[k] = parent_point.y[i] >= layout.high[i] - edge ? 1 : parent_point.y[i] <= layout.low[i] + edge ? -1 : 0;
    fixed[k] = bound[k] != 0 && bound[k] * at.gradient[i] < 0;
  }
  constexpr int kRounds = 8;
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::VectorXd answer = SolveFree(at.hessian, column.cross, fixed);
    const double left = column.square - column.cross.dot(answer), pull = column.slope - answer.dot(at.gradient);
    constexpr double kLeast = 1e-6;  // of the column: below it is rounding
    test.absorbed = std::clamp(1 - left / column.raw, 0.0, 1.0);
    const bool seen = left > kLeast * column.raw;
    test.scale = seen ? std::clamp(-pull / left, 0.0, 2.0) : 0;
    test.drop = -(test.scale * pull + 0.5 * test.scale * test.scale * left);
    test.dy = -(test.scale * answer);
    bool again = false;
    const Eigen::VectorXd slopes = at.gradient + test.scale * (column.cross - at.hessian * answer);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const bool hold = fixed[k] ? bound[k] * slopes[i] <= 0 : bound[k] * test.dy[i] > 0;
      if (bound[k] != 0 && hold != (fixed[k] != 0)) fixed[k] = hold, again = true;
    }
    if (!again) break;
  }
  return test;
}

}  // namespace

Snapshot Capture(FitProblem& problem, const FitPoint& point, double step) {
  GS_CHECK(problem.huber().plain());
  Snapshot snapshot{.derivatives = problem.Differentiate(point, {.step = step}), .linearization = {}};
  snapshot.linearization = Reduce(problem, point, snapshot.derivatives, Blocks::kNone);
  snapshot.valid = snapshot.derivatives.valid;
  snapshot.cost = snapshot.linearization.cost;
  return snapshot;
}

Snapshot Thin(const FitProblem& problem, const Snapshot& snapshot, const FitPoint& point, std::size_t count) {
  const std::size_t windows = problem.windows().size();
  if (!snapshot.valid || count >= windows) return snapshot;
  Snapshot thin;
  thin.derivatives.residuals.resize(windows);
  thin.derivatives.jacobians.resize(windows);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t w = i * windows / count;
    thin.derivatives.residuals[w] = snapshot.derivatives.residuals[w];
    thin.derivatives.jacobians[w] = snapshot.derivatives.jacobians[w];
  }
  thin.valid = thin.derivatives.valid = true;
  thin.linearization = Reduce(problem, point, thin.derivatives, Blocks::kNone);
  thin.cost = thin.linearization.cost;
  return thin;
}

ColumnTest TestColumn(FitProblem& child, const FitPoint& point, const FitProblem& parent, const FitPoint& parent_point,
                      const Snapshot& base) {
  const std::size_t windows = child.windows().size();
  GS_CHECK(parent.windows().size() == windows);
  WindowMask mask(windows);
  for (std::size_t w = 0; w < windows; ++w) mask[w] = base.derivatives.residuals[w].size() > 0;
  const Evaluation there = child.Evaluate(point, Keep::kResiduals, mask);
  std::vector<TrialColumn> parts(windows);
  child.pool().ForEach(windows, [&](std::size_t w, int) {
    if (mask[w] && there.residuals[w].size() > 0)
      parts[w] = WindowColumn(there.residuals[w], parent.windows()[w], w, base);
  });
  TrialColumn column{.cross = Eigen::VectorXd::Zero(base.linearization.gradient.size())};
  for (std::size_t w = 0; w < windows; ++w) {
    if (!mask[w]) continue;
    if (there.residuals[w].size() == 0) return {};
    column.cross += parts[w].cross;
    column.square += parts[w].square;
    column.slope += parts[w].slope;
    column.raw += parts[w].raw;
  }
  if (!(column.raw > 0)) return {.valid = true};
  return BestScale(column, parent, parent_point, base.linearization);
}

FitPoint FromParent(const FitProblem& parent, const FitPoint& point, const FitProblem& child,
                    const std::vector<double>& values, const Eigen::VectorXd& dy) {
  FitPoint moved = point;
  if (dy.size() == point.y.size())
    moved.y = (point.y + dy).cwiseMax(parent.layout().low).cwiseMin(parent.layout().high);
  return CarryOver(parent, moved, child, values);
}

std::vector<double> BlockCosts(FitProblem& problem, const FitPoint& point) {
  const Evaluation at = problem.Evaluate(point, Keep::kResiduals);
  std::vector<double> costs;
  for (std::size_t w = 0; w < problem.windows().size(); ++w) {
    const Eigen::VectorXd& residual = at.residuals[w];
    if (residual.size() == 0) return {};
    const FitWindow& window = problem.windows()[w];
    const Recording& recording = problem.recordings()[window.log];
    const std::size_t signals = recording.measured.size();
    const auto scored = static_cast<std::size_t>(window.scored());
    const double* time = recording.time_s.data() + window.rows.begin + window.first_scored;
    for (std::size_t begin = 0; begin < scored;) {
      std::size_t end = begin + 1;
      while (end < scored && time[end] - time[begin] < kFitPolicy.block_s) ++end;
      if (end < scored && time[scored - 1] - time[end] < 0.5 * kFitPolicy.block_s) end = scored;
      double cost = 0;
      for (std::size_t s = 0; s < signals; ++s) {
        for (std::size_t r = begin; r < end; ++r) {
          const double a = residual[static_cast<Eigen::Index>(s * scored + r)];
          cost += 0.5 * a * a;
        }
      }
      costs.push_back(cost);
      begin = end;
    }
  }
  return costs;
}

}  // namespace gapscope
