#include "src/diagnose/coarsen.h"

#include <algorithm>
#include <cmath>

#include "src/core/collect.h"
#include "src/core/statistics.h"

namespace gapscope {

namespace {

// Means over the steps between kept rows; the last value is the command's own.
std::vector<double> MeansOf(const std::vector<double>& fine, const std::vector<double>& time_s,
                            const std::vector<std::size_t>& kept) {
  std::vector<double> means = Collect(kept, [&](std::size_t row) { return fine[row]; });
  for (std::size_t k = 0; k + 1 < kept.size(); ++k) {
    double sum = 0;
    for (std::size_t row = kept[k]; row < kept[k + 1]; ++row) sum += fine[row] * (time_s[row + 1] - time_s[row]);
    means[k] = sum / (time_s[kept[k + 1]] - time_s[kept[k]]);
  }
  return means;
}

// A mean that is held for its step flattens what varies faster than the steps, once by the mean and once by the hold:
// at f by sinc(f step)^2, half a percent at 10 Hz and 4 ms, which is more than encoders miss. A twelfth of the second
// difference gives it back to second order; no further than the command itself goes there, so that jumps stay jumps.
std::vector<double> Sharpened(const std::vector<double>& means, const std::vector<double>& fine,
                              const std::vector<std::size_t>& kept) {
  std::vector<double> sharp = means;
  for (std::size_t k = 1; k + 2 < kept.size(); ++k) {
    const auto from = fine.begin() + static_cast<std::ptrdiff_t>(kept[k - 1]);
    const auto to = fine.begin() + static_cast<std::ptrdiff_t>(kept[k + 2]);
    const auto [low, high] = std::minmax_element(from, to);
    sharp[k] = std::clamp(means[k] - (means[k + 1] - 2 * means[k] + means[k - 1]) / 12, *low, *high);
  }
  return sharp;
}

}  // namespace

Recording Coarsen(const Recording& recording, double least_step_s) {
  // Where a sensor is slower than the log, the rows picked would miss its values.
  const bool kept_gaps = std::any_of(recording.measured.begin(), recording.measured.end(), [](const auto& m) {
    return std::any_of(m.values.begin(), m.values.end(), [](double value) { return !std::isfinite(value); });
  });
  if (kept_gaps) return recording;
  constexpr double kSlack = 0.95;  // of the step: stamps jitter
  std::vector<std::size_t> kept;
  for (std::size_t row = 0; row < recording.rows(); ++row) {
    if (kept.empty() || recording.time_s[row] - recording.time_s[kept.back()] >= kSlack * least_step_s)
      kept.push_back(row);
  }
  if (kept.size() == recording.rows() || kept.size() < 2) return recording;
  Recording coarse = recording;
  const auto pick = [&](const std::vector<double>& values) {
    return Collect(kept, [&](std::size_t row) { return values[row]; });
  };
  coarse.time_s = pick(recording.time_s);
  for (auto& measured : coarse.measured) measured.values = pick(measured.values);
  for (auto& command : coarse.commands) {
    const std::vector<double> fine = command.values;
    command.values = Sharpened(MeansOf(fine, recording.time_s, kept), fine, kept);
  }
  std::vector<double> steps;
  for (std::size_t k = 0; k + 1 < kept.size(); ++k) steps.push_back(coarse.time_s[k + 1] - coarse.time_s[k]);
  coarse.timeline.median_step_s = Median(std::move(steps));
  // A drive's torque follows its command at once: under the mean of a few commands it would seem to be late.
  const bool forces = std::any_of(recording.measured.begin(), recording.measured.end(), [](const auto& m) {
    return m.spec.scored && TraitsOf(m.spec.kind).stage != SignalStage::kState;
  });
  if (forces) coarse.finer = std::make_shared<const Recording>(recording);
  return coarse;
}

}  // namespace gapscope
