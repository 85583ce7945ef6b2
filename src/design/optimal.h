// The next experiment: of a library of inputs, each as large as the rig's limits allow, the one that says most about
// named parameters, or that tells named effects apart.
//
// Parameters: the covariance that a fit of the predicted log would have (ForetoldFit): its block of the named ones is
// the Cramer-Rao bound, with the other free parameters, a command shift and zero offsets as nuisances. The input with
// the smallest mean logarithm of their standard deviations (D-optimal for one parameter) wins. Goodwin and Payne,
// "Dynamic System Identification", 1977, ch. 6.
//
// Effects: each rival's prediction is imitated by every other one, as `tune` would fit it. What is left, in sensor
// floors, is how well the input separates the two (one that holds the other imitates it fully, and is not asked);
// the input whose least separated pair is farthest apart wins (Hunter and Reiner, "Designs for discriminating between
// two rival models", Technometrics 7, 1965).
#ifndef GAPSCOPE_DESIGN_OPTIMAL_H_
#define GAPSCOPE_DESIGN_OPTIMAL_H_

#include "src/design/rehearsal.h"
#include "src/design/sensitivity.h"
#include "src/design/waveform.h"

namespace gapscope {

struct OptimalOptions {
  RehearsalOptions rehearsal;
  double duration_s = 6;
  double margin = 0.9;   // share of every limit that may be used
  double amplitude = 0;  // largest command, SI; 0: the command's limit
  // Inputs are first scored by rough fits. The best ones, so many at a time, by full ones until none is left that could
  // be better.
  std::size_t batch = 2;
  std::vector<double> floors;   // per measured signal, SI; empty: FloorsOf
  double window_s = 0;          // rivals are compared in windows of this length; 0: in one run from rest
  double time_step_s = 0;       // of every simulation; 0: each model's own
  std::size_t max_windows = 0;  // that are compared; 0: all
  std::shared_ptr<const Coupling> coupling = nullptr;  // FitOptions::coupling
  Deadline deadline;                                   // inputs that are not scored by then are left out
};

struct InputScore {
  Waveform wave;
  double amplitude = 0;  // of the command, SI
  double score = 0;  // larger is better: floors between the least separated pair, or minus the mean logarithm of the
                     // standard deviations
  std::vector<double>
      per_target;  // parameters: standard deviation over |value|; effects: floors per ordered pair (truth, imitation)
  bool refined = false;
  Rehearsal rehearsal;  // under the base model
};

struct OptimalDesign {
  std::vector<std::string> targets;  // parameters; or "A against B": A the truth, B fitted to it
  std::vector<InputScore> inputs;    // best first
  std::vector<std::string> values;   // effect parameters that were assumed, "NAME=VALUE"
};

// The inputs that are tried, of unit amplitude: slow and fast, smooth and abrupt, large and (a quarter) small.
struct LibraryInput {
  Waveform wave;
  double share = 1;  // of the largest safe amplitude
};
std::vector<LibraryInput> InputLibrary(double duration_s, double rate_hz);

// `parameters`: indices in base.model. Errors: none of the library's inputs keeps the limits; a parameter that is
// frozen.
Result<OptimalDesign> DesignForParameters(const Hypothesis& base, const std::vector<int>& parameters,
                                          const OptimalOptions& options, ThreadPool& pool);

// `rivals`: at least two. Errors: as above, and a rival that cannot be simulated.
Result<OptimalDesign> DesignForRivals(const Hypothesis& base, const std::vector<Hypothesis>& rivals,
                                      const OptimalOptions& options, ThreadPool& pool);

// Whether a rival has all effects of the other one, or in their places effects that contain them, and more.
bool Holds(const Hypothesis& rival, const Hypothesis& other);

// The command that makes an input again.
std::string CommandFor(const std::string& experiment, const RehearsalOptions& rehearsal, const InputScore& input);

}  // namespace gapscope

#endif  // GAPSCOPE_DESIGN_OPTIMAL_H_
