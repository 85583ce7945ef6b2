// Huber's function: residuals beyond a threshold count linearly, so that a few wrong samples do not decide a fit
// (Huber, Ann. Math. Statist. 35, 1964).
#ifndef GAPSCOPE_FIT_ROBUST_H_
#define GAPSCOPE_FIT_ROBUST_H_

#include <Eigen/Core>
#include <vector>

#include "src/core/statistics.h"

namespace gapscope {

struct Huber {
  double threshold = kInfinity;  // in residual units; infinity: plain squares

  bool plain() const { return threshold == kInfinity; }
  // Sum of squares, large residuals linearly.
  double Sum(const Eigen::VectorXd& residual) const;
  // Rows of a residual and its Jacobian times the square root of their weights: with these, least squares has Huber's
  // gradient.
  void Weigh(Eigen::VectorXd& residual, Eigen::MatrixXd& jacobian) const;
};

// `deviations` robust standard deviations of all residuals that are not zero, by the median of their size; infinity
// where there are none.
double HuberThreshold(const std::vector<Eigen::VectorXd>& residuals, double deviations);

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_ROBUST_H_
