// What a solved fit knows of its parameters: intervals, directions that the logs leave open, parameters that go
// together.
//
// Cluster-robust ("sandwich") covariance: H^-1 (sum over half seconds of limbs of g g') H^-1, with the finite-sample
// factors of a clustered regression (Liang and Zeger, Biometrika 73, 1986; Cameron and Miller, J. Human Resources 50,
// 2015): right for coloured residuals and for a wrong noise model.
#ifndef GAPSCOPE_FIT_COVARIANCE_H_
#define GAPSCOPE_FIT_COVARIANCE_H_

#include <tuple>
#include <utility>
#include <vector>

#include "src/fit/objective.h"

namespace gapscope {

struct TunedParameter {
  int index = 0;                        // in the model
  double value = 0, low = 0, high = 0;  // 95 % interval; the bounds where nothing is known
  bool at_bound = false, identifiable = true;
};

// A direction in parameter space that the logs leave open.
struct FlatDirection {
  // Parameter, exponent (logarithmic) or weight; largest first, scaled to 1.
  std::vector<std::pair<int, double>> parts;
  double deviation = 0;  // standard deviation along it, as a share of the range
};

// How parameters vary together: the covariance of ln |value| where `logarithmic`, of the value elsewhere. Few blocks
// count: kNormalQuantile deviations are the 95 % interval.
struct Spread {
  std::vector<bool> logarithmic;
  Eigen::MatrixXd covariance;
};

struct Uncertainty {
  std::vector<TunedParameter> tuned;
  std::vector<FlatDirection> flat;
  Eigen::MatrixXd covariance;                            // of y
  Eigen::MatrixXd of_prior;                              // the part of it that what is known beforehand leaves
  double freedom = 1;                                    // of the part that the logs leave
  std::vector<std::tuple<int, int, double>> correlated;  // |correlation| above CovariancePolicy::correlated
  Spread spread;                                         // of `tuned`, in its order
};

// Half of the 95 % interval along a direction of y. What is known beforehand is no estimate from few blocks, so that
// the more of the variance is its, the nearer is the quantile to the normal one (Satterthwaite, Biometrics Bulletin 2,
// 1946).
double HalfInterval(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& of_prior, double freedom,
                    const Eigen::VectorXd& direction);

// Of parameters that are fitted only where the logs know them: those that do, judged by how residuals move at a point
// that need not be solved. The least known one is left out until the rest is as well known as `identifiable` asks, so
// that of numbers that act as one combination one stays. The noise is what one step of Gauss and Newton leaves.
std::vector<int> KnownOf(const FitProblem& problem, const Linearization& at, const std::vector<int>& asked);

// At a solved point. `at`: linearized there by central differences, with blocks. `beside`: a covariance of y that is
// added, for what the residuals do not say (a model's own error); empty: none.
Uncertainty EstimateUncertainty(const FitProblem& problem, const FitPoint& point, const Linearization& at,
                                const Eigen::MatrixXd& beside = {});

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_COVARIANCE_H_
