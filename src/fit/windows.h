// The stretches of logs that a fit simulates, each with a start of its own.
#ifndef GAPSCOPE_FIT_WINDOWS_H_
#define GAPSCOPE_FIT_WINDOWS_H_

#include <Eigen/Core>
#include <vector>

#include "replay/replay.h"
#include "src/fit/choose_windows.h"
#include "src/fit/layout.h"

namespace gapscope {

// Residuals of each window, weighted: signal by signal, each its scored rows; empty: left out, or not simulated.
using Residuals = std::vector<Eigen::VectorXd>;

// Which windows count: one entry per window; empty: all.
using WindowMask = std::vector<char>;

struct FitWindow {
  std::size_t log = 0;
  Window rows;
  std::size_t first_scored = 0;  // row in the window
  InitialState start;            // FitOptions::start; from the log: without offsets
  Eigen::VectorXd prior;         // weight of each number of the state
  Eigen::Index scored() const { return static_cast<Eigen::Index>(rows.rows() - first_scored); }
};

// The windows of all logs that the fold takes, at most as many as are asked for. Free runs are not among them.
std::vector<LogWindow> TakenWindows(const std::vector<Recording>& recordings, const FitOptions& options);

// `values`: parameters that the starts are read with.
std::vector<FitWindow> MakeFitWindows(const Model& model, const std::vector<Recording>& recordings,
                                      const FitOptions& options, const FitLayout& layout,
                                      const std::vector<double>& values);

// Priors of the windows' states that weigh the log's own initial states by its sensors' noise, in units of `residuals`:
// a model that misses by far must not make up for it by starting where the mechanism was not. Never less than now.
std::vector<Eigen::VectorXd> StatePriorsByNoise(const Model& model, const std::vector<Recording>& recordings,
                                                const FitLayout& layout, const std::vector<FitWindow>& windows,
                                                const Residuals& residuals);

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_WINDOWS_H_
