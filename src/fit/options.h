// What a fit is asked to do.
#ifndef GAPSCOPE_FIT_OPTIONS_H_
#define GAPSCOPE_FIT_OPTIONS_H_

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "replay/simulator.h"

namespace gapscope {

struct LogWindow;
class Coupling;

// Which windows of each log a problem takes: with kTrain and kHeldOut every third one is held out, from
// another one on in each log.
enum class Fold { kAll, kTrain, kHeldOut };

// What makes signals of different size comparable: 1 / standard deviation over the log, or 1 / root mean square
// (mujoco.sysid's choice).
enum class Normalization { kDeviation, kRootMeanSquare };

// Whether the residuals are those of windows that each start from the log, of one free run per log, or of both.
enum class ObjectiveKind { kWindows, kFreeRun, kBoth };

// Where a window starts: where the log says, which zero offsets move, or at rest at the model's initial pose.
enum class WindowStart { kLog, kRest };

// Which windows are taken where there are more than enough: evenly over the logs, which stand for all of them, or those
// that say most (ChooseWindows).
enum class WindowChoice { kEven, kTelling };

// By the experiment's signals, nonzero: moved; empty: all, or nothing is known.
using MovedSignals = std::vector<char>;

struct FitOptions {
  std::vector<int> free;  // indices of tuned parameters
  ObjectiveKind objective = ObjectiveKind::kWindows;
  WindowStart start = WindowStart::kLog;
  double window_s = 1.0;
  double lead_in_s = 0.05;  // start of a window that is not scored
  Fold fold = Fold::kAll;
  std::size_t max_windows = 0;  // 0: all; free runs are never left out
  WindowChoice choice = WindowChoice::kEven;
  // TakenWindows of these options, where many problems on the same logs share them; null: chosen anew.
  std::shared_ptr<const std::vector<LogWindow>> windows;
  // What moves no signal in common is differenced together, but in central differences; null: nothing is known.
  std::shared_ptr<const Coupling> coupling;
  double time_step_s = 0;           // 0: the model's
  StepKind steps = StepKind::kOwn;  // of all replays
  bool fit_offsets = true;          // zero offsets of measured positions, per log
  bool fit_shift = true;            // StampShift within +-1 sample, common to all logs
  bool fit_states = true;           // initial state of each window
  double shift_range_s = 0;         // shifts lie within +- this; 0: one sample
  StampShift stamps;                // where no shift is fitted: these
  // Per experiment signal: residual = weight * (predicted - measured); empty: 1 / standard deviation.
  std::vector<double> weights;
  Normalization normalization = Normalization::kDeviation;
  // Standard deviation of what is known of the base parameters beforehand, as a share of their range; 0: nothing.
  double prior_share = 0;
  double prior_offset_rad = 0;       // likewise of zero offsets, around zero; 0: nothing
  double prior_shift_s = 0;          // likewise of the shift
  std::vector<double> prior_centre;  // values that base parameters are known to lie around; empty: the start
  double prior_scale = 1;            // multiplies what is known, as the variance of the residuals does that of the data
  // Torques and stiffnesses of effects as logarithms, those of zero and cubics excepted: a factor common to all torques
  // is then a straight line.
  bool logarithmic_effects = false;
  // An effect's size and angle (or rest) as the two terms that act linearly (Parameter::with): as size and angle they
  // make curved valleys.
  bool linear_terms = false;
  // Bounds of base parameters that differ from the model's, by name.
  std::map<std::string, std::pair<double, double>> bounds;
  double huber = 0;  // residuals beyond this many robust standard deviations are weighted down; 0: plain squares
};

// What was computed: replays are passes over all windows, steps those of the simulator.
struct Work {
  std::size_t evaluations = 0, replays = 0, steps = 0;
  Work& operator+=(const Work& other) {
    evaluations += other.evaluations, replays += other.replays, steps += other.steps;
    return *this;
  }
};

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_OPTIONS_H_
