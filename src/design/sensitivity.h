// What an input shows of a model: the fit that `tune` would make of the log that the input is foretold to bring, with
// that fit's coordinates, bounds, nuisances and derivatives (src/fit).
#ifndef GAPSCOPE_DESIGN_SENSITIVITY_H_
#define GAPSCOPE_DESIGN_SENSITIVITY_H_

#include <memory>
#include <string>
#include <vector>

#include "src/fit/optimizers.h"

namespace gapscope {

struct Hypothesis {
  std::string name;
  std::shared_ptr<const Model> model;
  std::vector<double> values;  // as model->Nominal()
};

// Standard deviation of one reading, SI: half a milliradian and the quantisation of a position; 0.02 rad/s of a speed;
// 1 % of a torque's largest value, at least 1e-9.
double FloorOf(const MeasuredSpec& spec, const std::vector<double>& values);
// Floors per measured signal of a rehearsal.
std::vector<double> FloorsOf(const Recording& predicted);
// Readings closer than this carry the same noise: sensors' noise is coloured.
inline constexpr double kNoiseCorrelation_s = 0.01;

// What an input is foretold to bring.
struct ForetoldLog {
  const Recording& log;
  std::vector<double> floors;  // per signal of the log
  double window_s = 0;
  double time_step_s = 0;  // 0: the model's
  StepKind steps = StepKind::kOwn;
  std::size_t max_windows = 0;                         // 0: all
  std::shared_ptr<const Coupling> coupling = nullptr;  // FitOptions::coupling
};

// The fit of a model's free parameters to the scored signals of a log that begins at rest. Residuals are in floors, and
// rows within the noise's correlation time count once. Nuisances: each position's zero, and the commands' shift within
// half a sample; known beforehand: FitPolicy::known_share of base parameters, likewise zeros, and the shift. With
// ForetoldLog::window_s above zero each window of that length begins where the log is, and its initial state is a
// nuisance too.
class ForetoldFit {
 public:
  ForetoldFit(const Hypothesis& hypothesis, const ForetoldLog& foretold);

  FitProblem& problem() { return problem_; }
  // Cramer-Rao bound: standard deviation of each coordinate of the problem's space, in its own units, at the start. Of
  // `wanted` coordinates nothing is known beforehand but that they lie within their bounds. Empty: not simulated.
  std::vector<double> Deviations(const std::vector<std::size_t>& wanted);
  // Root mean square of the residuals, in floors, after a fit with at most this many Jacobians, or until the
  // deadline. Infinite: not simulated.
  double Misfit(int jacobians, const Deadline& deadline = {});

 private:
  const double rows_per_reading_;
  const std::shared_ptr<const Model> model_;
  const std::vector<Recording> logs_;
  ThreadPool pool_{1};
  FitProblem problem_;
};

}  // namespace gapscope

#endif  // GAPSCOPE_DESIGN_SENSITIVITY_H_
