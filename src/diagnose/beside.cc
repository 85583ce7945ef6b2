#include "src/diagnose/beside.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "src/core/collect.h"
#include "src/core/dense.h"
#include "src/core/statistics.h"
#include "src/diagnose/discrepancy.h"
#include "src/diagnose/exchange.h"
#include "src/diagnose/policy.h"
#include "src/diagnose/torques.h"

namespace gapscope {
namespace {

Eigen::MatrixXd Inverse(const Eigen::MatrixXd& m) {
  return Ldlt(m).Solve(Eigen::MatrixXd::Identity(m.rows(), m.cols()));
}

Eigen::MatrixXd Widening(const ColumnTable& table, const TorquePrior& torques) {
  const Eigen::Index n = table.gram.parameters, residual = table.sum.cols() - 1;
  Eigen::MatrixXd widening = Eigen::MatrixXd::Zero(n, n);
  const std::vector<Eigen::Index> free = table.FreeCoordinates();
  if (!(torques.ratio > 0) || free.empty()) return widening;
  const double h = torques.share;
  Eigen::MatrixXd own = h * table.sum(free, free);
  Eigen::VectorXd slope = h * table.sum(free, residual);
  for (std::size_t i = 0; i < free.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double weight = h * table.bounds.prior_weight[free[i]];
    own(k, k) += weight;
    slope[k] += weight * table.bounds.prior_gone[free[i]];
  }
  Eigen::MatrixXd of_torques = h * table.sum(table.torques, table.torques);
  of_torques.diagonal().array() += 1 / torques.ratio;
  const Eigen::MatrixXd cross = h * table.sum(free, table.torques);
  const Ldlt solver(of_torques);
  const Eigen::MatrixXd beside = own - cross * solver.Solve(cross.transpose());
  const Eigen::MatrixXd inverse = Inverse(beside);
  const Eigen::VectorXd moved = -inverse * (slope - cross * solver.Solve(h * table.sum(table.torques, residual)));
  const Eigen::MatrixXd added = torques.variance * (inverse - Inverse(own)) + moved * moved.transpose();
  for (std::size_t a = 0; a < free.size(); ++a) {
    for (std::size_t b = 0; b < free.size(); ++b)
      widening(free[a], free[b]) = added(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
  }
  return widening;
}

// Coefficient of a trial's effect beside the torques that is exceeded with the policy's probability; NaN: nothing is
// known.
double UpperCoefficient(const ColumnTable& table, const Trial& trial, bool both_signs, const TorquePrior& torques) {
  const Eigen::MatrixXd& m = table.reduced;
  const auto columns = Collect(trial.columns, [&](Eigen::Index c) { return table.Reduced(c); }),
             torque = Collect(table.torques, [&](Eigen::Index c) { return table.Reduced(c); });
  const double h = torques.share;
  Eigen::MatrixXd own = h * m(columns, columns);
  Eigen::VectorXd slope = h * m(columns, m.cols() - 1);
  if (torques.ratio > 0) {
    Eigen::MatrixXd of_torques = h * m(torque, torque);
    of_torques.diagonal().array() += 1 / torques.ratio;
    const Eigen::MatrixXd cross = h * m(columns, torque);
    const Ldlt solver(of_torques);
    own -= cross * solver.Solve(cross.transpose());
    slope -= cross * solver.Solve(h * m(torque, m.cols() - 1));
  }
  if (!(own.diagonal().minCoeff() > 0)) return kNaN;
  const Eigen::VectorXd best = -Ldlt(own).Solve(slope);
  const double quantile = kDiagnosePolicy.evidence.bound_deviations;
  const Eigen::MatrixXd spread = torques.variance * Inverse(own);
  if (trial.form == Trial::Form::kAngle)
    return best.norm() + quantile * std::sqrt(std::max(spread.diagonal().maxCoeff(), 0.0));
  return (both_signs ? std::abs(best[0]) : std::max(best[0], 0.0)) + quantile * std::sqrt(std::max(spread(0, 0), 0.0));
}

// Sizes that an effect stays below: by the trial nearest to its bound, where the columns say most.
std::vector<EffectEstimate> BoundsOfEffect(const Workbench& bench, const ColumnTable& table, const EffectUse& use,
                                           const TorquePrior& torques) {
  const auto placed = PlacedParameters(use, *bench.rig, bench.scales);
  const bool both_signs = placed.front().low < 0;
  const Trial* nearest = nullptr;
  double coefficient = 0, distance = kInfinity;
  for (const Trial& trial : table.trials) {
    if (trial.use != use) continue;
    const double upper = UpperCoefficient(table, trial, both_signs, torques);
    if (!(upper > 0) || std::abs(std::log(upper)) >= distance) continue;
    nearest = &trial, coefficient = upper, distance = std::abs(std::log(upper));
  }
  std::vector<EffectEstimate> bounds;
  // Far beyond its trial values an effect is not what its columns say.
  constexpr double kFar = 3;
  if (!nearest || coefficient > kFar) return bounds;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const PlacedParameter& p = placed[i];
    if (p.trials.empty() || (p.role != ParameterRole::kSize && p.role != ParameterRole::kTime)) continue;
    const double trial = nearest->values[i];
    if (trial == p.neutral) continue;
    // A limit is nothing at its largest value: where a tighter one is excluded, the true one lies above.
    if (p.neutral == p.high && coefficient > 1) continue;
    const double moved = p.neutral + coefficient * (trial - p.neutral), value = p.neutral == p.high ? trial
                                                                                : both_signs        ? std::abs(moved)
                                                                                                    : moved;
    bounds.push_back({.key = p.key, .unit = p.unit, .value = value, .low = value, .high = value});
  }
  return bounds;
}

// A free-form torque fitted to one of two parts of each log, judged on the other one, and the other way round.
double FreeFormShare(const ColumnTable& table, const TorquePrior& torques) {
  if (!(torques.ratio > 0)) return 0;
  const Eigen::Index residual = table.sum.cols() - 1;
  std::vector<Eigen::Index> columns = table.FreeCoordinates();
  const std::size_t own = columns.size();
  columns.insert(columns.end(), table.torques.begin(), table.torques.end());
  double before = 0, after = 0;
  for (std::size_t fold = 0; fold < kFolds; ++fold) {
    const Eigen::MatrixXd &a = table.gram.parts[fold], &b = table.gram.parts[kFolds - 1 - fold];
    Eigen::MatrixXd hessian = a(columns, columns);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      hessian(k, k) += i < own ? table.bounds.prior_weight[columns[i]] : 1 / (torques.ratio * torques.share);
      hessian(k, k) *= 1 + 1e-9;
    }
    const Eigen::VectorXd c = -Ldlt(hessian).Solve(a(columns, residual));
    before += b(residual, residual);
    after += b(residual, residual) + 2 * c.dot(b(columns, residual)) + c.dot(b(columns, columns) * c);
  }
  return before > 0 ? std::clamp(1 - after / before, 0.0, 1.0) : 0;
}

}  // namespace

BesideTorques LookBeside(const Workbench& bench, Candidate& final, const std::vector<EffectUse>& uses) {
  BesideTorques result;
  Derivatives derivatives = final.problem->Differentiate(final.point, {.step = 0.01});
  *bench.work += derivatives.work;
  if (!derivatives.valid) return result;
  final.derivatives = std::make_shared<const Derivatives>(std::move(derivatives));
  const std::size_t residuals = final.problem->residuals();
  const ColumnTable table = MakeColumns(bench, final, uses, MakeTorques(bench));
  if (table.valid && !table.torques.empty()) {
    const TorquePrior torques = TorquesBeside(table, residuals);
    result.widening = Widening(table, torques);
    for (const EffectUse& use : uses) {
      if (auto bounds = BoundsOfEffect(bench, table, use, torques); !bounds.empty()) result.bounds[use] = bounds;
    }
  }
  const ColumnTable free_form = MakeFolds(bench, final, MakeFreeForm(bench));
  if (free_form.valid && !free_form.torques.empty())
    result.free_form = FreeFormShare(free_form, TorquesBeside(free_form, residuals));
  final.derivatives.reset();
  return result;
}

std::vector<Beyond> NotExcluded(const Workbench& bench, Candidate& at, const std::vector<Beyond>& asked) {
  std::vector<Beyond> known, open;
  std::vector<InPlace> children;
  for (const Beyond& one : asked) {
    auto shapes = UsualBeyond(bench, at, one.simpler, one.richer);
    if (shapes.empty()) continue;
    auto child = MakeCandidate(bench, With(Without(at.effects, one.simpler), one.richer));
    if (!child.ok()) continue;
    known.push_back(one);
    children.push_back({.child = std::move(child).value(), .use = one.richer, .values = std::move(shapes)});
  }
  if (children.empty()) return open;
  const ColumnTable table = MakeInPlace(bench, at, children, MakeTorques(bench));
  if (!table.valid) return open;
  const TorquePrior torques = TorquesBeside(table, at.problem->residuals());
  for (std::size_t i = 0; i < known.size(); ++i) {
    if (std::any_of(table.trials.begin(), table.trials.end(), [&](const Trial& trial) {
          return trial.effect == i && !(UpperCoefficient(table, trial, false, torques) < 1);
        }))
      open.push_back(known[i]);
  }
  return open;
}

}  // namespace gapscope
