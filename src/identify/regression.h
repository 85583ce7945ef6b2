// Linear least squares whose intervals know that neighbouring rows share their error.
//
//   y = X b + e,  cov(b) = H^-1 (sum over blocks of g g') H^-1,  H = X'X,  g = sum over the block's rows of x e
//
// Blocks are six correlation times of the slowest of the products x e long, so that their sums are nearly independent
// (Liang and Zeger, "Longitudinal data analysis using generalized linear models", Biometrika 73, 1986; a block
// bootstrap of the same blocks has this variance). Intervals: Student's t with blocks - 1 degrees of freedom.
#ifndef GAPSCOPE_IDENTIFY_REGRESSION_H_
#define GAPSCOPE_IDENTIFY_REGRESSION_H_

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "src/core/result.h"
#include "src/identify/identification.h"

namespace gapscope {

// Rows of several logs. Add() leaves out rows with a number that is not finite.
class Rows {
 public:
  explicit Rows(std::vector<std::string> columns) : columns_(std::move(columns)) {}
  void Add(int log, double time_s, double y, const std::vector<double>& x);
  std::size_t size() const { return y_.size(); }
  const std::vector<std::string>& columns() const { return columns_; }
  Eigen::MatrixXd X() const;
  Eigen::VectorXd Y() const;
  const std::vector<int>& logs() const { return log_; }
  const std::vector<double>& times() const { return time_; }

 private:
  std::vector<std::string> columns_;
  std::vector<double> y_, x_, time_;
  std::vector<int> log_;
};

struct Regression {
  Eigen::VectorXd value, low, high;  // 95 %
  Eigen::MatrixXd covariance;
  Eigen::VectorXd residual;
  double r2 = 0, rmse = 0, quantile = 0;  // quantile: of the intervals, in standard deviations
  std::size_t rows = 0, blocks = 0;
};

// `dt_s`: step between rows. Errors: fewer rows than 20 or twice the columns; columns that cannot be told apart in
// these rows (named).
Result<Regression> Regress(const Rows& rows, double dt_s);

// Root mean square residual of the same fit, without anything else. Infinity where Regress would refuse.
double ResidualRms(const Rows& rows);

// Covariance of least-squares values as above, from a Jacobian and residuals that are already there.
struct BlockCovariance {
  Eigen::MatrixXd covariance;
  double quantile = 0;
  std::size_t blocks = 0;
};
BlockCovariance CovarianceByBlocks(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residual,
                                   const std::vector<int>& logs, const std::vector<double>& times, double dt_s);

Estimate ToEstimate(const Regression& fit, Eigen::Index i, std::string name, std::string unit);

}  // namespace gapscope

#endif  // GAPSCOPE_IDENTIFY_REGRESSION_H_
