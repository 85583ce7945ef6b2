// What an input shows of a model's parameters: predictions divided by the sensors' floors, and their derivatives.
#ifndef GAPSCOPE_DESIGN_SENSITIVITY_H_
#define GAPSCOPE_DESIGN_SENSITIVITY_H_

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "src/design/rehearsal.h"

namespace gapscope {

// A model with the parameters that a fit of it would move. Not thread-safe: one per worker.
struct Hypothesis {
  std::string name;
  std::shared_ptr<const Model> model;
  std::vector<double> values;
  struct Free {
    int parameter = 0;
    bool logarithmic = false;  // where the lower bound is above zero
    double step = 0;           // finite difference, in search coordinates
    double prior = 0;          // standard deviation known beforehand, in search coordinates; 0: nothing is known
    double low = 0, high = 0;  // in search coordinates
  };
  std::vector<Free> free;
  double ToSearch(std::size_t i, double value) const;
  double ToValue(std::size_t i, double search) const;
};

// Standard deviation that a nominal value is known by, where a prior is asked for: 20 % (contract of the rigs).
inline constexpr double kNominalShare = 0.2;

// Frees the parameters that are not frozen (those of `known_beforehand` by a prior about their value), all effect
// parameters without.
Hypothesis MakeHypothesis(std::string name, std::shared_ptr<const Model> model, std::vector<double> values);

// Standard deviation of one reading, SI: half a milliradian and the quantisation of a position; 0.02 rad/s of a speed;
// 1 % of a torque's largest value, at least 1e-9.
double FloorOf(const MeasuredSpec& spec, const std::vector<double>& values);
// Readings closer than this carry the same noise: sensors' noise is coloured.
inline constexpr double kNoiseCorrelation_s = 0.01;

// Scored signals of a simulated recording over their floors, signal by signal. Empty after a divergence.
class Predictor {
 public:
  Predictor(const Hypothesis& hypothesis, double time_step_s);
  // `shift_s`: commands act later.
  Eigen::VectorXd Predict(const Recording& input, const std::vector<double>& values, double shift_s,
                          const std::vector<double>& floors);
  // Columns: the hypothesis's free parameters, the shift in half samples, one zero offset per position signal. Empty
  // after a divergence.
  Eigen::MatrixXd Jacobian(const Recording& input, const std::vector<double>& values, double shift_s,
                           const std::vector<double>& floors, const Eigen::VectorXd& at);
  Simulator& simulator() { return simulator_; }

 private:
  const Hypothesis& hypothesis_;
  Simulator simulator_;
  std::vector<double> buffer_;
};

// Floors per measured signal of a rehearsal.
std::vector<double> FloorsOf(const Recording& predicted);

}  // namespace gapscope

#endif  // GAPSCOPE_DESIGN_SENSITIVITY_H_
