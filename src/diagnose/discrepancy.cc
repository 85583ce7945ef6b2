#include "src/diagnose/discrepancy.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "src/core/collect.h"
#include "src/core/dense.h"
#include "src/diagnose/policy.h"

namespace gapscope {
namespace {

// Rows and columns of the reduced matrix: [wanted | residual], `out` taken out of them.
Eigen::MatrixXd TakeOut(const ColumnTable& table, std::span<const Eigen::Index> wanted,
                        std::span<const Eigen::Index> out) {
  const Eigen::MatrixXd& m = table.reduced;
  std::vector<Eigen::Index> keep, gone;
  for (const Eigen::Index c : wanted) keep.push_back(table.Reduced(c));
  keep.push_back(m.cols() - 1);
  for (const Eigen::Index c : out) gone.push_back(table.Reduced(c));
  Eigen::MatrixXd kept = m(keep, keep);
  if (gone.empty()) return kept;
  Eigen::MatrixXd own = m(gone, gone);
  own.diagonal() *= 1 + 1e-9;
  const Eigen::MatrixXd cross = m(gone, keep);
  kept -= cross.transpose() * Ldlt(own).Solve(cross);
  return kept;
}

}  // namespace

TorquePrior LikeliestTorques(const Eigen::MatrixXd& m, double numbers, double share) {
  const Eigen::Index k = m.cols() - 1;
  const SymmetricEigen eigen(share * m.topLeftCorner(k, k));
  const Eigen::VectorXd y = eigen.vectors.transpose() * (share * m.col(k).head(k));
  const double square = share * m(k, k), most = k > 0 ? std::max(eigen.values.maxCoeff(), 1e-300) : 1;
  TorquePrior best{.share = share};
  for (int step = -1; step <= 60; ++step) {
    // In units of the strongest direction: from nothing to all of it.
    const double q = step < 0 ? 0 : std::pow(10.0, -3 + 0.15 * step) / most;
    double left = square, log_sum = 0;
    for (Eigen::Index i = 0; i < k; ++i) {
      const double w = std::max(eigen.values[i], 0.0);
      left -= y[i] * y[i] * q / (1 + q * w);
      log_sum += std::log1p(q * w);
    }
    const double variance = std::max(left, 1e-12 * square) / numbers,
                 value = -0.5 * numbers * std::log(variance) - 0.5 * log_sum;
    if (step < 0 || value > best.likelihood)
      best = {.ratio = q, .variance = variance, .share = share, .likelihood = value};
  }
  return best;
}

TorquePrior TorquesBeside(const ColumnTable& table, std::span<const Eigen::Index> columns, std::size_t residuals) {
  const double numbers = kDiagnosePolicy.evidence.per_block * static_cast<double>(table.gram.blocks.size()),
               share = numbers / static_cast<double>(std::max<std::size_t>(1, residuals));
  return LikeliestTorques(TakeOut(table, table.torques, columns), numbers, share);
}

double Mimicry(const ColumnTable& table, const std::vector<RandomTorque>& torques, double held) {
  const Eigen::MatrixXd& m = table.reduced;
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  std::size_t hits = 0;
  const std::size_t sums = kDiagnosePolicy.evidence.sums;
  for (std::size_t s = 0; s < sums; ++s) {
    const auto of = static_cast<RandomTorque::Of>(s % 3);
    const std::size_t count = 2 + random() % 5;
    std::vector<std::size_t> pool;
    for (std::size_t t = 0; t < torques.size(); ++t) {
      if (torques[t].of == of) pool.push_back(t);
    }
    Eigen::VectorXd f = Eigen::VectorXd::Zero(m.cols());  // in the residual's place
    for (std::size_t i = 0; i < count && !pool.empty(); ++i) {
      const Eigen::Index c = table.Reduced(table.torques[pool[random() % pool.size()]]);
      f[c] += normal(random) / std::sqrt(std::max(m(c, c), 1e-300));
    }
    const Eigen::VectorXd cross = m * f;
    const double square = f.dot(cross);
    if (!(square > 0)) continue;
    double most = 0;
    for (const Trial& trial : table.trials) {
      if (trial.columns.size() == 1) {
        const Eigen::Index e = table.Reduced(trial.columns.front());
        // As the residual would be lowered by a positive coefficient.
        if (cross[e] < 0 && m(e, e) > 0) most = std::max(most, cross[e] * cross[e] / m(e, e));
      } else {
        const auto columns = Collect(trial.columns, [&](Eigen::Index c) { return table.Reduced(c); });
        Eigen::MatrixXd own = m(columns, columns);
        own.diagonal() *= 1 + 1e-9;
        const Eigen::VectorXd part = cross(columns);
        most = std::max(most, part.dot(Ldlt(own).Solve(part)));
      }
    }
    hits += most / square >= held;
  }
  return static_cast<double>(hits) / static_cast<double>(sums);
}

}  // namespace gapscope
