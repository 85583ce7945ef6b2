#include "src/identify/regression.h"

#include <algorithm>
#include <cmath>

#include "src/compare/noise.h"
#include "src/core/statistics.h"

namespace gapscope {

void Rows::Add(int log, double time_s, double y, const std::vector<double>& x) {
  GS_CHECK(x.size() == columns_.size());
  if (!std::isfinite(y)) return;
  for (const double value : x) {
    if (!std::isfinite(value)) return;
  }
  y_.push_back(y);
  x_.insert(x_.end(), x.begin(), x.end());
  time_.push_back(time_s);
  log_.push_back(log);
}

Eigen::MatrixXd Rows::X() const {
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      x_.data(), static_cast<Eigen::Index>(y_.size()), static_cast<Eigen::Index>(columns_.size()));
}
Eigen::VectorXd Rows::Y() const {
  return Eigen::Map<const Eigen::VectorXd>(y_.data(), static_cast<Eigen::Index>(y_.size()));
}

BlockCovariance CovarianceByBlocks(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residual,
                                   const std::vector<int>& logs, const std::vector<double>& times, double dt_s) {
  constexpr double kTimes = 6;
  constexpr std::size_t kFewestBlocks = 10;
  const Eigen::Index rows = jacobian.rows(), columns = jacobian.cols();
  Eigen::MatrixXd products = jacobian.array().colwise() * residual.array();
  // The slowest product, as a share of the rows of one log at most.
  double tau = dt_s;
  for (Eigen::Index c = 0; c < columns; ++c) {
    const double own = CorrelationTime({products.col(c).data(), static_cast<std::size_t>(rows)}, dt_s);
    if (std::isfinite(own)) tau = std::max(tau, own);
  }
  const double length_s = std::min(kTimes * tau, static_cast<double>(rows) * dt_s / kFewestBlocks);
  Eigen::MatrixXd middle = Eigen::MatrixXd::Zero(columns, columns);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(columns);
  std::size_t blocks = 0;
  double begin = rows > 0 ? times[0] : 0;
  for (Eigen::Index r = 0; r < rows; ++r) {
    const std::size_t k = static_cast<std::size_t>(r);
    if (r > 0 && (logs[k] != logs[k - 1] || times[k] - begin >= length_s)) {
      middle += sum * sum.transpose();
      ++blocks;
      sum.setZero();
      begin = times[k];
    }
    sum += products.row(r).transpose();
  }
  middle += sum * sum.transpose();
  ++blocks;
  const Eigen::MatrixXd inverse =
      (jacobian.transpose() * jacobian).ldlt().solve(Eigen::MatrixXd::Identity(columns, columns));
  const double b = static_cast<double>(blocks), correction = blocks > 1 ? b / (b - 1) : 1;
  return {.covariance = correction * inverse * middle * inverse,
          .quantile = StudentQuantile(std::max(1.0, b - 1)),
          .blocks = blocks};
}

Result<Regression> Regress(const Rows& rows, double dt_s) {
  const std::size_t needed = std::max<std::size_t>(20, 2 * rows.columns().size());
  if (rows.size() < needed) {
    return Error{.what = "too few rows are fit for this identification",
                 .actual = std::to_string(rows.size()),
                 .allowed = "at least " + std::to_string(needed)};
  }
  const Eigen::MatrixXd x = rows.X();
  const Eigen::VectorXd y = rows.Y();
  // Columns scaled to length one: their smallest singular value says whether they can be told apart.
  Eigen::VectorXd scale = x.colwise().norm();
  for (Eigen::Index c = 0; c < x.cols(); ++c) {
    if (!(scale[c] > 0))
      return Error{.what = "the log does not exercise '" + rows.columns()[static_cast<std::size_t>(c)] + "'",
                   .cure = "a log in which it changes"};
  }
  const Eigen::MatrixXd scaled = x * scale.cwiseInverse().asDiagonal();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(scaled.transpose() * scaled, Eigen::ComputeFullV);
  if (svd.singularValues()[x.cols() - 1] < 1e-9 * svd.singularValues()[0]) {
    const Eigen::VectorXd flat = svd.matrixV().col(x.cols() - 1);
    std::string names;
    for (Eigen::Index c = 0; c < x.cols(); ++c) {
      if (std::abs(flat[c]) > 0.1)
        names += (names.empty() ? "'" : ", '") + rows.columns()[static_cast<std::size_t>(c)] + "'";
    }
    return Error{.what = "the log cannot tell " + names + " apart", .cure = "another kind of motion"};
  }
  Regression fit;
  fit.value = scale.cwiseInverse().asDiagonal() * (scaled.transpose() * scaled).ldlt().solve(scaled.transpose() * y);
  fit.residual = y - x * fit.value;
  fit.rows = rows.size();
  const double n = static_cast<double>(rows.size()), mean = y.mean();
  fit.rmse = std::sqrt(fit.residual.squaredNorm() / n);
  const double spread = (y.array() - mean).square().sum();
  fit.r2 = spread > 0 ? 1 - fit.residual.squaredNorm() / spread : 0;
  const BlockCovariance blocks = CovarianceByBlocks(scaled, fit.residual, rows.logs(), rows.times(), dt_s);
  fit.covariance = scale.cwiseInverse().asDiagonal() * blocks.covariance * scale.cwiseInverse().asDiagonal();
  fit.quantile = blocks.quantile;
  fit.blocks = blocks.blocks;
  const Eigen::VectorXd half = fit.quantile * fit.covariance.diagonal().cwiseMax(0).cwiseSqrt();
  fit.low = fit.value - half;
  fit.high = fit.value + half;
  return fit;
}

double ResidualRms(const Rows& rows) {
  if (rows.size() < std::max<std::size_t>(20, 2 * rows.columns().size())) return INFINITY;
  const Eigen::MatrixXd x = rows.X();
  const Eigen::VectorXd y = rows.Y(), scale = x.colwise().norm();
  if (!(scale.minCoeff() > 0)) return INFINITY;
  const Eigen::MatrixXd scaled = x * scale.cwiseInverse().asDiagonal();
  const Eigen::VectorXd value = (scaled.transpose() * scaled).ldlt().solve(scaled.transpose() * y);
  return std::sqrt((y - scaled * value).squaredNorm() / static_cast<double>(rows.size()));
}

Estimate ToEstimate(const Regression& fit, Eigen::Index i, std::string name, std::string unit) {
  return {
      .name = std::move(name), .unit = std::move(unit), .value = fit.value[i], .low = fit.low[i], .high = fit.high[i]};
}

}  // namespace gapscope
