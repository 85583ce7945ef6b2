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

bool BeginsAtRest(const Recording& recording) {
  const auto& time = recording.time_s;
  std::size_t start = 1;
  while (start + 1 < time.size() && time[start] < time.front() + kFitPolicy.start_s) ++start;
  return std::ranges::all_of(recording.measured, [&](const Recording::Measured& measured) {
    if (measured.spec.kind != SignalKind::kPosition) return true;
    const auto& values = measured.values;
    const double first = std::abs(values[start] - values[0]);
    bool moves_more = !std::isfinite(first);
    for (std::size_t i = 0; i + start < values.size() && !moves_more; ++i)
      moves_more = kFitPolicy.rest_share * std::abs(values[i + start] - values[i]) >= first;
    return moves_more;
  });
}

// The windows of a log as it is cut, but for its unknown past: the first one begins where that has passed, or goes
// where that leaves less than half of it. A log's only window keeps at least its second half.
std::vector<Window> KnownWindows(const Recording& recording, double window_s) {
  std::vector<Window> known, all = MakeWindows(recording, ReplayMode::kWindows, window_s);
  if (all.empty() || BeginsAtRest(recording)) return all;
  const auto& time = recording.time_s;
  for (Window window : all) {
    const std::size_t half = window.rows() / 2, whole = window.begin;
    while (window.begin < whole + half && time[window.begin] < time.front() + kFitPolicy.unknown_past_s) ++window.begin;
    if (window.begin < whole + half || all.size() == 1) known.push_back(window);
  }
  return known;
}

// Root mean square of each signal's residuals over a log; 0 where there are none.
std::vector<double> MismatchOf(std::size_t log, const Recording& recording, const std::vector<FitWindow>& windows,
                               const Residuals& residuals) {
  const std::size_t signals = recording.measured.size();
  std::vector<double> squares(signals, 0.0), rows(signals, 0.0);
  for (std::size_t w = 0; w < windows.size(); ++w) {
    if (windows[w].log != log) continue;
    const Eigen::Index scored = windows[w].scored();
    for (std::size_t s = 0; s < signals; ++s) {
      if (residuals[w].size() > 0)
        squares[s] += residuals[w].segment(static_cast<Eigen::Index>(s) * scored, scored).squaredNorm();
      const auto& measured = recording.measured[s].values;
      for (std::size_t row = windows[w].rows.begin + windows[w].first_scored; row < windows[w].rows.end; ++row)
        rows[s] += std::isfinite(measured[row]);
    }
  }
  for (std::size_t s = 0; s < signals; ++s) squares[s] = rows[s] > 0 ? std::sqrt(squares[s] / rows[s]) : 0;
  return squares;
}

}  // namespace

std::vector<LogWindow> TakenWindows(const std::vector<Recording>& recordings, const FitOptions& options) {
  if (options.windows) return *options.windows;
  std::vector<LogWindow> windows;
  for (std::size_t l = 0; l < recordings.size(); ++l) {
    const auto all = KnownWindows(recordings[l], options.window_s);
    for (std::size_t i = 0; i < all.size(); ++i) {
      // Another third in each log: repeats of one command are not all held out at the same time.
      if (options.fold == Fold::kAll || ((i + l) % 3 == 1) == (options.fold == Fold::kHeldOut))
        windows.push_back({l, all[i]});
    }
  }
  const std::size_t most = options.max_windows;
  if (most == 0 || windows.size() <= most) return windows;
  if (options.choice == WindowChoice::kTelling) return ChooseWindows(recordings, windows, most);
  std::vector<LogWindow> even;
  even.reserve(most);
  for (std::size_t i = 0; i < most; ++i) even.push_back(windows[i * windows.size() / most]);
  return even;
}

std::vector<FitWindow> MakeFitWindows(const Model& model, const std::vector<Recording>& recordings,
                                      const FitOptions& options, const FitLayout& layout,
                                      const std::vector<double>& values) {
  std::vector<FitWindow> windows;
  const auto add = [&](const LogWindow& taken, double lead_in_s) {
    const Recording& recording = recordings[taken.log];
    windows.push_back({.log = taken.log,
                       .rows = taken.rows,
                       .first_scored = FirstScored(recording, taken.rows, lead_in_s),
                       .start = options.start == WindowStart::kRest
                                    ? AtRest(model)
                                    : InitialStateAt(model, recording, taken.rows.begin, values),
                       .prior = layout.state_priors[taken.log]});
  };
  if (options.objective != ObjectiveKind::kFreeRun) {
    for (const LogWindow& taken : TakenWindows(recordings, options)) add(taken, options.lead_in_s);
  }
  for (std::size_t l = 0; l < recordings.size() && options.objective != ObjectiveKind::kWindows; ++l) {
    for (const Window& rows : MakeWindows(recordings[l], ReplayMode::kFreeRun, options.window_s)) add({l, rows}, 0);
  }
  std::stable_sort(windows.begin(), windows.end(),
                   [](const FitWindow& a, const FitWindow& b) { return a.log < b.log; });
  return windows;
}

std::vector<Eigen::VectorXd> StatePriorsByNoise(const Model& model, const std::vector<Recording>& recordings,
                                                const FitLayout& layout, const std::vector<FitWindow>& windows,
                                                const Residuals& residuals) {
  std::vector<Eigen::VectorXd> priors = Collect(windows, &FitWindow::prior);
  for (std::size_t l = 0; l < recordings.size(); ++l) {
    const auto& signals = layout.signals[l];
    const std::vector<double> mismatch = MismatchOf(l, recordings[l], windows, residuals);
    // Of two numbers of a window's state, from `state` on, that signal `s` gives.
    const auto weigh = [&](std::size_t s, Eigen::Index state) {
      const auto& measured = recordings[l].measured[s];
      // Behind a filter a joint is not where the log says.
      if (model.source(measured.index).cutoff >= 0) return;
      const double noise =
          EstimateNoise(recordings[l].time_s, measured.values, {.resolution = measured.spec.resolution}).total_std;
      if (!(noise > 0)) return;
      for (std::size_t w = 0; w < windows.size(); ++w) {
        if (windows[w].log != l) continue;
        double* prior = priors[w].data() + state;
        prior[0] = std::max(prior[0], mismatch[s] / noise);
        prior[1] = std::max(prior[1], mismatch[s] / noise * kFitPolicy.speed_prior_s);
      }
    };
    for (std::size_t s = 0; s < signals.size(); ++s) {
      if (signals[s].joint_state >= 0) weigh(s, signals[s].joint_state);
    }
    const UnseenStates& unseen = layout.unseen[l];
    for (std::size_t i = 0; i < unseen.dofs.size(); ++i) {
      if (unseen.dofs[i].signal >= 0)
        weigh(static_cast<std::size_t>(unseen.dofs[i].signal), unseen.first + 2 * static_cast<Eigen::Index>(i));
    }
  }
  return priors;
}

}  // namespace gapscope
