#include "src/diagnose/coarsen.h"

#include <algorithm>

#include "src/core/collect.h"
#include "src/core/statistics.h"

namespace gapscope {

Recording Coarsen(const Recording& recording, double least_step_s) {
  // A drive's torque follows its command at once: under the mean of a few commands it would seem to be late.
  const bool torque = std::any_of(recording.measured.begin(), recording.measured.end(), [](const auto& m) {
    return m.spec.scored && TraitsOf(m.spec.kind).stage == SignalStage::kForces;
  });
  if (torque) return recording;
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
    command.values = pick(fine);
    for (std::size_t k = 0; k + 1 < kept.size(); ++k) {
      double sum = 0;
      for (std::size_t row = kept[k]; row < kept[k + 1]; ++row)
        sum += fine[row] * (recording.time_s[row + 1] - recording.time_s[row]);
      command.values[k] = sum / (coarse.time_s[k + 1] - coarse.time_s[k]);
    }
  }
  std::vector<double> steps;
  for (std::size_t k = 0; k + 1 < kept.size(); ++k) steps.push_back(coarse.time_s[k + 1] - coarse.time_s[k]);
  coarse.timeline.median_step_s = Median(std::move(steps));
  return coarse;
}

}  // namespace gapscope
