// Parameters fitted until replayed trajectories match the hardware; scored on data that the fit did not see; with what
// can and cannot be known.
#ifndef GAPSCOPE_TUNE_TUNE_H_
#define GAPSCOPE_TUNE_TUNE_H_

#include <optional>
#include <string>
#include <vector>

#include "src/fit/covariance.h"
#include "src/fit/optimizers.h"
#include "src/tune/split.h"

namespace gapscope {

struct TuneOptions {
  std::vector<int> free;      // parameters; empty: all that are not frozen
  std::vector<int> if_known;  // beside them those of these that the logs know (KnownOf)
  ObjectiveKind objective = ObjectiveKind::kBoth;
  double window_s = 1.0;
  bool fit_offsets = true, fit_shift = true, fit_states = true;
  Normalization normalization = Normalization::kDeviation;
  double huber = 4;        // see FitOptions
  double time_step_s = 0;  // 0: chosen
  StepKind steps = StepKind::kOwn;
  int starts = 2;  // the given values, then random ones inside the bounds
  SolveOptions solve;
  std::string journal;  // file; empty: none
  bool resume = false;
};

// Of a fit that is asked for nothing but starts and a seed: windows as the experiment's replays.
TuneOptions DefaultTuneOptions(const ReplayDefaults& replay, int starts, unsigned long seed);

struct TuneSummary {
  std::string optimizer;
  Termination termination = Termination::kConverged;
  bool starts_agree = true;
  std::vector<double> start_costs;
  std::size_t evaluations = 0, replays = 0;
  double wall_s = 0, solve_s = 0;  // all; the optimiser alone, without intervals and scores
  double time_step_s = 0;
  StampShift stamps;
  std::vector<double> values;  // all parameters of the model
  std::vector<TunedParameter> tuned;
  std::vector<int> left_frozen;  // of TuneOptions::if_known
  std::vector<FlatDirection> flat;
  std::vector<std::tuple<int, int, double>> correlated;  // |correlation| above 0.95
  Spread spread;                                         // of `tuned`
  std::vector<LogReplay> train, held_out;                // at the tuned values
  // See ReplayError; nominal on the held-out data.
  double error_nominal = 0, error_train = 0, error_held_out = 0;
  std::string split;
  std::vector<std::string> warnings;  // what went wrong beside the fit, as a journal that cannot be written
};

// Errors: nothing free; a journal that cannot be used; a start that cannot be simulated.
Result<TuneSummary> Tune(const Model& model, const DataSplit& data, const std::vector<double>& start,
                         const TuneOptions& options, ThreadPool& pool);

// Replays at fixed parameters with only the nuisances fitted (offsets per log and initial states): how held-out data is
// scored.
struct FixedParameters {
  const std::vector<double>& values;
  std::optional<StampShift> stamps;  // none: fitted too, within one sample
  StampShift* found = nullptr;       // receives them
};
std::vector<LogReplay> Evaluate(const Model& model, const std::vector<Recording>& recordings,
                                const FixedParameters& fixed, ReplayMode mode, const TuneOptions& options,
                                ThreadPool& pool);

}  // namespace gapscope

#endif  // GAPSCOPE_TUNE_TUNE_H_
