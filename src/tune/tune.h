// Parameters fitted until replayed trajectories match the hardware; scored on data that the fit did not see; with what
// can and cannot be known.
#ifndef GAPSCOPE_TUNE_TUNE_H_
#define GAPSCOPE_TUNE_TUNE_H_

#include <optional>
#include <string>
#include <vector>

#include "src/tune/solve.h"

namespace gapscope {

// Which logs, or which rows of a single log, are fitted and which are kept to score.
struct DataSplit {
  std::vector<Recording> train, held_out;
  std::string how;     // one line for the user
  bool asked = false;  // the user said which
};
// `held_out` indices are kept; with none, every third log from the second on; with two logs the second; with one its
// last 30 % of time.
DataSplit SplitData(std::vector<Recording> recordings, const std::vector<std::size_t>& held_out);
// Rows [begin, end) as a recording of its own; time starts anew.
Recording Slice(const Recording& recording, std::size_t begin, std::size_t end);

struct TuneOptions {
  std::vector<int> free;  // parameters; empty: all that are not frozen
  Objective objective = Objective::kBoth;
  double window_s = 1.0;
  bool fit_offsets = true, fit_shift = true, fit_states = true;
  Normalization normalization = Normalization::kDeviation;
  double huber = 4;        // see FitOptions
  double time_step_s = 0;  // 0: chosen
  int starts = 2;          // the given values, then random ones inside the bounds
  SolveOptions solve;
  std::string journal;  // file; empty: none
  bool resume = false;
};

struct TunedParameter {
  int index = 0;
  double value = 0, low = 0, high = 0;  // 95 % interval; the bounds where nothing is known
  bool at_bound = false, identifiable = true;
};

// A direction in parameter space that the logs leave open.
struct FlatDirection {
  std::vector<std::pair<int, double>> parts;  // parameter, exponent (logarithmic) or weight; largest first, scaled to 1
  double deviation = 0;                       // standard deviation along it, as a share of the range
};

struct TuneSummary {
  std::string optimizer;
  Termination termination = Termination::kConverged;
  bool starts_agree = true;
  std::vector<double> start_costs;
  std::size_t evaluations = 0, replays = 0;
  double wall_s = 0, solve_s = 0;  // all; the optimiser alone, without intervals and scores
  double time_step_s = 0, shift_s = 0;
  std::vector<double> values;  // all parameters of the model
  std::vector<TunedParameter> tuned;
  std::vector<FlatDirection> flat;
  std::vector<std::tuple<int, int, double>> correlated;           // |correlation| above 0.95
  std::vector<LogReplay> train, held_out;                         // at the tuned values
  double error_nominal = 0, error_train = 0, error_held_out = 0;  // see ReplayError; nominal on the held-out data
  std::string split;
};

// Errors: nothing free; a journal that cannot be used; a start that cannot be simulated.
Result<TuneSummary> Tune(const Model& model, const DataSplit& data, const std::vector<double>& start,
                         const TuneOptions& options, ThreadPool& pool);

// Replays at fixed parameters with only the nuisances fitted (offsets per log and initial states): how held-out data is
// scored. `shift_s`: of the commands; none: fitted too, within one sample.
std::vector<LogReplay> Evaluate(const Model& model, const std::vector<Recording>& recordings,
                                const std::vector<double>& values, std::optional<double> shift_s, ReplayMode mode,
                                const TuneOptions& options, ThreadPool& pool);

// Intervals, flat directions and correlations at a solved point (in tune/uncertainty.cc).
struct Uncertainty {
  std::vector<TunedParameter> tuned;
  std::vector<FlatDirection> flat;
  std::vector<std::tuple<int, int, double>> correlated;
};
Uncertainty EstimateUncertainty(FitProblem& problem, const FitPoint& point, const Model& model, double step);

}  // namespace gapscope

#endif  // GAPSCOPE_TUNE_TUNE_H_
