#include "src/diagnose/discrepancy.h"

#include <algorithm>
#include <cmath>

#include "src/core/collect.h"
#include "src/core/dense.h"
#include "src/diagnose/policy.h"

namespace gapscope {
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

namespace {

TorquePrior TorquesIn(const ColumnTable& table, const Eigen::MatrixXd& reduced, std::size_t residuals) {
  const double numbers = kDiagnosePolicy.evidence.per_block * static_cast<double>(table.gram.half_seconds),
               share = numbers / static_cast<double>(std::max<std::size_t>(1, residuals));
  std::vector<Eigen::Index> kept = Collect(table.torques, [&](Eigen::Index c) { return table.Reduced(c); });
  kept.push_back(reduced.cols() - 1);
  return LikeliestTorques(reduced(kept, kept), numbers, share);
}

}  // namespace

TorquePrior TorquesBeside(const ColumnTable& table, std::size_t residuals) {
  return TorquesIn(table, table.reduced, residuals);
}

double LikelihoodByLimb(const ColumnTable& table, std::size_t residuals) {
  if (table.gram.parts.empty()) return TorquesBeside(table, residuals).likelihood;
  double sum = 0;
  for (const Eigen::MatrixXd& limb : table.gram.parts)
    sum += TorquesIn(table, Reduce(table, limb), residuals).likelihood;
  return sum;
}

}  // namespace gapscope
