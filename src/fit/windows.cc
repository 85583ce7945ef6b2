#include "src/fit/windows.h"

#include <algorithm>
#include <cmath>

#include "src/compare/noise.h"
#include "src/core/collect.h"
#include "src/fit/policy.h"

namespace gapscope {
namespace {

// The first row of a window that is scored: the start's own small error dies out before it.
std::size_t FirstScored(const Recording& recording, const Window& rows, double lead_in_s) {
  const double begin = recording.time_s[rows.begin];
  std::size_t first = 1;
  while (first + 2 < rows.rows() && recording.time_s[rows.begin + first] - begin < lead_in_s) ++first;
  return first;
}

// Root mean square of each signal's residuals over a log; 0 where there are none.
std::vector<double> MismatchOf(std::size_t log, std::size_t signals, const std::vector<FitWindow>& windows,
                               const Residuals& residuals) {
  std::vector<double> squares(signals, 0.0);
  std::size_t rows = 0;
  for (std::size_t w = 0; w < windows.size(); ++w) {
    if (windows[w].log != log) continue;
    const Eigen::Index scored = windows[w].scored();
    for (std::size_t s = 0; s < signals && residuals[w].size() > 0; ++s)
      squares[s] += residuals[w].segment(static_cast<Eigen::Index>(s) * scored, scored).squaredNorm();
    rows += static_cast<std::size_t>(scored);
  }
  for (double& square : squares) square = rows > 0 ? std::sqrt(square / static_cast<double>(rows)) : 0;
  return squares;
}

}  // namespace

std::vector<FitWindow> MakeFitWindows(const Model& model, const std::vector<Recording>& recordings,
                                      const FitOptions& options, const FitLayout& layout,
                                      const std::vector<double>& values) {
  std::vector<FitWindow> windows;
  for (std::size_t l = 0; l < recordings.size(); ++l) {
    const Recording& recording = recordings[l];
    const auto add = [&](ReplayMode mode) {
      const auto all = MakeWindows(recording, mode, options.window_s);
      for (std::size_t i = 0; i < all.size(); ++i) {
        // Another third in each log: repeats of one command are not all held out at the same time.
        if (options.fold != Fold::kAll && ((i + l) % 3 == 1) != (options.fold == Fold::kHeldOut)) continue;
        const double lead_in_s = mode == ReplayMode::kWindows ? options.lead_in_s : 0;
        windows.push_back({.log = l,
                           .rows = all[i],
                           .first_scored = FirstScored(recording, all[i], lead_in_s),
                           .start = options.start == WindowStart::kRest
                                        ? AtRest(model)
                                        : InitialStateAt(model, recording, all[i].begin, values),
                           .prior = layout.state_priors[l]});
      }
    };
    if (options.objective != ObjectiveKind::kFreeRun) add(ReplayMode::kWindows);
    if (options.objective != ObjectiveKind::kWindows) add(ReplayMode::kFreeRun);
  }
  if (options.max_windows == 0 || windows.size() <= options.max_windows) return windows;
  std::vector<FitWindow> kept;
  kept.reserve(options.max_windows);
  for (std::size_t i = 0; i < options.max_windows; ++i)
    kept.push_back(std::move(windows[i * windows.size() / options.max_windows]));
  return kept;
}

std::vector<Eigen::VectorXd> StatePriorsByNoise(const Model& model, const std::vector<Recording>& recordings,
                                                const FitLayout& layout, const std::vector<FitWindow>& windows,
                                                const Residuals& residuals) {
  std::vector<Eigen::VectorXd> priors = Collect(windows, &FitWindow::prior);
  for (std::size_t l = 0; l < recordings.size(); ++l) {
    const auto& signals = layout.signals[l];
    const std::vector<double> mismatch = MismatchOf(l, signals.size(), windows, residuals);
    for (std::size_t s = 0; s < signals.size(); ++s) {
      const auto& measured = recordings[l].measured[s];
      // Behind a filter a joint is not where the log says.
      if (signals[s].joint_state < 0 || model.source(measured.index).cutoff >= 0) continue;
      const double noise =
          EstimateNoise(recordings[l].time_s, measured.values, {.resolution = measured.spec.resolution}).total_std;
      if (!(noise > 0)) continue;
      for (std::size_t w = 0; w < windows.size(); ++w) {
        if (windows[w].log != l) continue;
        double* prior = priors[w].data() + signals[s].joint_state;
        prior[0] = std::max(prior[0], mismatch[s] / noise);
        prior[1] = std::max(prior[1], mismatch[s] / noise * kFitPolicy.speed_prior_s);
      }
    }
  }
  return priors;
}

}  // namespace gapscope
