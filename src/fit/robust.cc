#include "src/fit/robust.h"

#include <algorithm>
#include <cmath>

#include "src/core/statistics.h"

namespace gapscope {

double Huber::Sum(const Eigen::VectorXd& residual) const {
  if (plain()) return residual.squaredNorm();
  double sum = 0;
  for (const double r : residual) {
    const double a = std::abs(r);
    sum += a <= threshold ? a * a : threshold * (2 * a - threshold);
  }
  return sum;
}

void Huber::Weigh(Eigen::VectorXd& residual, Eigen::MatrixXd& jacobian) const {
  if (plain()) return;
  for (Eigen::Index i = 0; i < residual.size(); ++i) {
    if (const double a = std::abs(residual[i]); a > threshold) {
      const double weight = std::sqrt(threshold / a);
      jacobian.row(i) *= weight;
      residual[i] *= weight;
    }
  }
}

double HuberThreshold(const std::vector<Eigen::VectorXd>& residuals, double deviations) {
  constexpr double kDeviationOverMedian = 1.4826;  // of normal residuals
  std::vector<double> sizes;
  for (const auto& part : residuals) {
    for (const double r : part) {
      if (r != 0) sizes.push_back(std::abs(r));
    }
  }
  if (sizes.empty()) return kInfinity;
  return deviations * kDeviationOverMedian * Median(std::move(sizes));
}

}  // namespace gapscope
