// What holds the unknowns of a fit beside the data: a pull to the start, weak enough to only hold directions that the
// logs leave open, and what is known of base parameters and sensors' zeros beforehand.
#ifndef GAPSCOPE_FIT_PRIOR_H_
#define GAPSCOPE_FIT_PRIOR_H_

#include <Eigen/Core>

#include "src/fit/layout.h"

namespace gapscope {

// Adds 1/2 sum weight (y - centre)^2 to the cost. Made before a solve, and not changed by it.
struct Prior {
  Eigen::VectorXd centre, weight;  // of y; weight: on the hessian's diagonal
  Eigen::VectorXd known;  // what is known beforehand: inverse variances, `scale` times of which are in `weight`
  double scale = 1;       // FitOptions::prior_scale, times the misfit's variance (FitProblem::CountKnown)

  double Cost(const Eigen::VectorXd& y) const { return 0.5 * weight.cwiseProduct((y - centre).cwiseAbs2()).sum(); }
  Eigen::VectorXd Gradient(const Eigen::VectorXd& y) const { return weight.cwiseProduct(y - centre); }
  // Half the squares of what is known, in its standard deviations.
  double Surprise(const Eigen::VectorXd& y) const { return 0.5 * known.cwiseProduct((y - centre).cwiseAbs2()).sum(); }
  void SetScale(double to) {
    weight += (to - scale) * known;
    scale = to;
  }
};

// `start`: y of the start; `residuals`: how many scored numbers the problem has; `stated`: parameters with the bounds
// that they have of themselves, which say what is known of them even where a search may go beyond.
Prior MakePrior(const SearchSpace& space, const FitLayout& layout, const FitOptions& options,
                const Eigen::VectorXd& start, std::size_t residuals, const std::vector<Parameter>& stated);

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_PRIOR_H_
