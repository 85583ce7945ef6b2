// Logs replayed through a model: free run or windows, on several threads, the same bytes for any number of them.
#ifndef GAPSCOPE_REPLAY_REPLAY_H_
#define GAPSCOPE_REPLAY_REPLAY_H_

#include <string>
#include <vector>

#include "replay/policy.h"
#include "replay/scales.h"
#include "replay/simulator.h"
#include "src/core/thread_pool.h"

namespace gapscope {

struct ReplayOptions {
  ReplayMode mode = ReplayMode::kFreeRun;
  double window_s = 1.0;   // kWindows: length; windows follow each other without overlap
  double time_step_s = 0;  // 0: chosen (see ChooseTimeStep)
  double step_error_share = TimeStepPolicy{}.error_share;  // by which that is done
  std::vector<double> values;                              // parameters, as model.Nominal(); empty: nominal
  bool keep_poses = false;                                 // fill LogReplay::qpos
};

// Measured and predicted on the recording's stamps.
struct SignalTrace {
  std::string signal;
  SignalKind kind = SignalKind::kPosition;
  bool scored = true;
  double resolution = 0;
  std::vector<double> measured, predicted;  // predicted: NaN where not simulated, or at a window's first row
};

struct LogReplay {
  std::string log_path;
  Outcome outcome = Outcome::kCompleted;
  double diverged_at_s = 0;
  std::size_t windows = 0, diverged_windows = 0;
  std::vector<double> time_s;
  std::vector<SignalTrace> signals;
  std::vector<double>
      qpos;  // with keep_poses: rows x model nq, the simulated pose at each stamp; NaN after a divergence
};

// The recording's measurements with nothing predicted yet.
LogReplay EmptyTraces(const Recording& recording);

struct ReplayResult {
  ReplayMode mode = ReplayMode::kFreeRun;
  double time_step_s = 0;
  double time_step_error = 0;  // change of the combined error when the step is halved
  std::vector<LogReplay> logs;
  double wall_s = 0, simulated_s = 0;
  std::size_t steps = 0;
};

// The windows of a recording: one for a free run; else windows of `window_s`, the last one at least half as long.
std::vector<Window> MakeWindows(const Recording& recording, ReplayMode mode, double window_s);

ReplayResult Replay(const Model& model, const std::vector<Recording>& recordings, const ReplayOptions& options,
                    ThreadPool& pool);

// The largest step, of the log's own sample time halved again and again (down to a 32nd of the model's time step),
// whose halving changes the combined error by less than `step_error_share` of it, 1 % where nothing else is asked.
struct TimeStep {
  double step_s = 0;
  double error_change = 0;  // of the combined error
};
TimeStep ChooseTimeStep(const Model& model, const std::vector<Recording>& recordings, const ReplayOptions& options,
                        ThreadPool& pool);

// Of predicted less measured, over the rows that have both; NaN: there are none.
double MeanSquareError(const SignalTrace& signal);

// Root mean square over scored signals of (RMSE / standard deviation of the measured signal), then over logs; NaN rows
// are left out, a log that diverged gives infinity.
double ReplayError(const std::vector<LogReplay>& logs);

}  // namespace gapscope

#endif  // GAPSCOPE_REPLAY_REPLAY_H_
