#include "src/diagnose/short_windows.h"

#include <algorithm>
#include <chrono>

#include "src/diagnose/base_fit.h"
#include "src/diagnose/policy.h"

namespace gapscope {
namespace {

bool IsLost(const Candidate& base) { return !(base.held_out_error <= kDiagnosePolicy.search.lost); }

// In the windows of a bench, at the base model's values.
Result<bool> IsLostIn(const Workbench& bench, const Candidate& base) {
  GS_ASSIGN(Candidate same, MakeCandidate(bench, {}));
  same.values = base.values;
  ScoreCandidate(bench, &same);
  return IsLost(same);
}

double ShortestWindow(const DataSplit& data) {
  double step_s = 0;
  for (const auto* logs : {&data.train, &data.held_out}) {
    for (const auto& recording : *logs) step_s = std::max(step_s, recording.timeline.median_step_s);
  }
  return std::max(kDiagnosePolicy.search.least_window_s,
                  static_cast<double>(kDiagnosePolicy.search.least_samples) * step_s);
}

// So much of the time that is left; none asked for: none.
Deadline ShareOf(Deadline deadline, double share) {
  if (!deadline.time) return deadline;
  const auto now = std::chrono::steady_clock::now();
  const std::chrono::duration<double> left = *deadline.time - now;
  deadline.time = now + std::chrono::duration_cast<std::chrono::steady_clock::duration>(share * left);
  return deadline;
}

// As many windows as take the same steps.
Workbench WithWindows(const Workbench& bench, const Model& model, double window_s) {
  Workbench other = bench;
  other.window_s = window_s;
  const double count = static_cast<double>(bench.max_windows) * bench.window_s / window_s;
  ChooseWindows(model, static_cast<std::size_t>(count), &other);
  other.work = std::make_shared<Work>();
  other.most_steps =
      static_cast<std::size_t>(kDiagnosePolicy.search.short_share * static_cast<double>(bench.most_steps));
  other.deadline = ShareOf(bench.deadline, kDiagnosePolicy.search.short_share);
  other.bounds = std::make_shared<std::map<std::string, std::pair<double, double>>>();
  other.coupling = std::make_shared<Coupling>();
  return other;
}

Hint HintOf(const Candidate& candidate) {
  Hint hint{.effects = candidate.effects, .values = {}};
  const auto& parameters = candidate.model->parameters();
  for (std::size_t i = 0; i < parameters.size(); ++i) hint.values[parameters[i].name] = candidate.values[i];
  return hint;
}

}  // namespace

Result<ShortSearch> SearchShortWindows(const Workbench& bench, const Candidate& base, const Say& say) {
  ShortSearch result;
  if (!IsLost(base)) return result;
  const double shortest_s = ShortestWindow(*bench.data);
  for (double window_s = bench.window_s / 2; window_s >= shortest_s; window_s /= 2) {
    const Workbench shorter = WithWindows(bench, *base.model, window_s);
    GS_ASSIGN(const bool lost, IsLostIn(shorter, base));
    const bool last = !lost || window_s / 2 < shortest_s;
    if (last) {
      GS_ASSIGN(const auto found, FitBase(shorter, say));
      FindEffects(shorter, {}, say, found.get());
      result.hints = {HintOf(*found->base), HintOf(*found->chosen)};
    }
    result.work += *shorter.work;
    if (last) break;
  }
  return result;
}

}  // namespace gapscope
