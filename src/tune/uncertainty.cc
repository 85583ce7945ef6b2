#include <algorithm>
#include <cmath>

#include "src/tune/tune.h"

namespace gapscope {
namespace {

constexpr double kFlatShare = 0.25;  // a direction whose deviation exceeds this share of the range is not known
constexpr double kCorrelated = 0.95;
constexpr double kBoundShare = 1e-3;        // of the range
constexpr double kLeastEigenvalue = 1e-13;  // of the largest: below is rounding

// 97.5 % quantile of Student's t (Abramowitz & Stegun 26.7.5, two terms).
double StudentQuantile(double freedom) {
  const double z = 1.959964;
  return freedom < 1 ? 12.7
                     : z + (z * z * z + z) / (4 * freedom) +
                           (5 * std::pow(z, 5) + 16 * z * z * z + 3 * z) / (96 * freedom * freedom);
}

}  // namespace

// Cluster-robust ("sandwich") covariance: H^-1 (sum over half-second blocks of g g') H^-1, with the finite-sample
// factors of a clustered regression (Liang & Zeger, Biometrika 73, 1986; Cameron & Miller, J. Human Resources 50,
// 2015): right for coloured residuals and for a wrong noise model.
Uncertainty EstimateUncertainty(FitProblem& problem, const FitPoint& point, const Model& model, double step) {
  Uncertainty result;
  const auto& coordinates = problem.coordinates();
  const auto n = static_cast<Eigen::Index>(coordinates.size());
  const Linearization at = problem.Linearize(point, step, FitProblem::Columns::kCentral);
  const Eigen::Index all = point.y.size();
  Eigen::MatrixXd meat = Eigen::MatrixXd::Zero(all, all);
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(all);
  const double blocks = static_cast<double>(at.block_gradients.size());
  for (const auto& g : at.block_gradients) mean += g / std::max(1.0, blocks);
  // Neighbouring blocks share slow residuals: one lag with Bartlett's weight (Newey & West, Econometrica 55, 1987).
  for (std::size_t b = 0; b < at.block_gradients.size(); ++b) {
    const Eigen::VectorXd g = at.block_gradients[b] - mean;
    meat += g * g.transpose();
    if (b + 1 < at.block_gradients.size() && at.block_logs[b] == at.block_logs[b + 1]) {
      const Eigen::VectorXd next = at.block_gradients[b + 1] - mean;
      meat += 0.5 * (g * next.transpose() + next * g.transpose());
    }
  }
  const double freedom = std::max(1.0, blocks - static_cast<double>(all));
  meat *= blocks / freedom;
  const Eigen::VectorXd range = problem.high() - problem.low();
  // In units of each coordinate's range, so that flat directions mean the same for all. What the anchor adds is no
  // knowledge.
  Eigen::MatrixXd hessian = at.hessian;
  hessian.diagonal() -= problem.anchor_weight();
  hessian = range.asDiagonal() * hessian * range.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(hessian);
  const double largest = std::max(eigen.eigenvalues().maxCoeff(), 1e-300);
  // Whitened: sandwich = W meat' W', the model's own covariance = noise W W'. A direction never counts as better known
  // than the model's own covariance says, which few blocks could pretend; raising eigenvalues keeps the matrix
  // consistent.
  const Eigen::MatrixXd whitener =
      eigen.eigenvectors() *
      eigen.eigenvalues().cwiseMax(kLeastEigenvalue * largest).cwiseSqrt().cwiseInverse().asDiagonal();
  const double noise = 2 * at.cost / std::max<double>(1, static_cast<double>(problem.residuals()));
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> spread(whitener.transpose() * range.asDiagonal() * meat *
                                                              range.asDiagonal() * whitener);
  const Eigen::MatrixXd half_covariance =
      whitener * spread.eigenvectors() * spread.eigenvalues().cwiseMax(noise).cwiseSqrt().asDiagonal();
  const Eigen::MatrixXd covariance = half_covariance * half_covariance.transpose();
  const Eigen::MatrixXd model_based = noise * whitener * whitener.transpose();

  const double quantile = StudentQuantile(freedom);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Coordinate& c = coordinates[static_cast<std::size_t>(i)];
    const double deviation = std::sqrt(covariance(i, i));
    TunedParameter tuned{.index = c.parameter, .value = c.ToValue(point.y[i])};
    const double half = quantile * deviation * range[i];
    tuned.low = c.ToValue(std::max(c.low, point.y[i] - half));
    tuned.high = c.ToValue(std::min(c.high, point.y[i] + half));
    tuned.at_bound = std::min(point.y[i] - c.low, c.high - point.y[i]) <= kBoundShare * range[i];
    tuned.identifiable = deviation < kFlatShare;
    if (!tuned.identifiable) {
      tuned.low = model.parameters()[c.parameter].low;
      tuned.high = model.parameters()[c.parameter].high;
    }
    result.tuned.push_back(tuned);
  }
  const Eigen::MatrixXd own = covariance.topLeftCorner(n, n);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> directions(own);
  for (Eigen::Index k = n - 1; k >= 0; --k) {
    const double deviation = std::sqrt(std::max(0.0, directions.eigenvalues()[k]));
    if (deviation < kFlatShare) break;
    FlatDirection flat{.deviation = deviation};
    Eigen::VectorXd parts(n);
    for (Eigen::Index i = 0; i < n; ++i) parts[i] = directions.eigenvectors()(i, k) * range[i];
    Eigen::Index leading = 0;
    parts.cwiseAbs().maxCoeff(&leading);
    const double scale = parts[leading];
    for (Eigen::Index i = 0; i < n; ++i) {
      if (std::abs(parts[i]) > 0.2 * std::abs(scale))
        flat.parts.emplace_back(coordinates[static_cast<std::size_t>(i)].parameter, parts[i] / scale);
    }
    std::stable_sort(flat.parts.begin(), flat.parts.end(),
                     [](const auto& a, const auto& b) { return std::abs(a.second) > std::abs(b.second); });
    result.flat.push_back(std::move(flat));
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = i + 1; j < n; ++j) {
      const double correlation = model_based(i, j) / std::sqrt(model_based(i, i) * model_based(j, j));
      if (std::abs(correlation) > kCorrelated)
        result.correlated.emplace_back(coordinates[static_cast<std::size_t>(i)].parameter,
                                       coordinates[static_cast<std::size_t>(j)].parameter, correlation);
    }
  }
  return result;
}

}  // namespace gapscope
