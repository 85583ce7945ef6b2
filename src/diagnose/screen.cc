#include "src/diagnose/screen.h"

#include <algorithm>
#include <cmath>

namespace gapscope {
namespace {

// All combinations of trial values; a parameter without trials stays where a fit starts.
std::vector<std::vector<double>> Trials(const std::vector<PlacedParameter>& parameters) {
  std::vector<std::vector<double>> all = {{}};
  for (const auto& p : parameters) {
    std::vector<std::vector<double>> next;
    const std::vector<double> values = p.trials.empty() ? std::vector<double>{p.start} : p.trials;
    for (const auto& head : all) {
      for (const double value : values) {
        next.push_back(head);
        next.back().push_back(value);
      }
    }
    all = std::move(next);
  }
  return all;
}

// Where the test asks the parameters that carry the effect's size to go; a place (rest, phase, periods) stays on its trial value.
double StepTo(const PlacedParameter& p, double trial, double scale) {
  constexpr double kLeastScale = 0.3, kMostScale = 2;
  const bool place = p.key.find("rest") != std::string::npos || p.key.find("phase") != std::string::npos || p.key.find("periods") != std::string::npos;
  if (p.trials.empty() || place || p.neutral == p.high) return trial;
  return std::clamp(p.neutral + std::clamp(scale, kLeastScale, kMostScale) * (trial - p.neutral), p.low, p.high);
}

}  // namespace

Trial TryEffect(const Workbench& bench, Candidate& child, const EffectUse& use, const FitProblem& parent, const FitPoint& point, const Snapshot& base) {
  Trial best;
  const Model& model = *child.model;
  const auto placed = model.EffectParameters(use, bench.scales);
  if (!placed.ok()) return best;
  const std::vector<double> nominal = model.Nominal();
  for (const auto& trial : Trials(placed.value())) {
    std::vector<double> tried = nominal;
    for (std::size_t i = 0; i < trial.size(); ++i) tried[model.IndexOf(placed.value()[i].name)] = trial[i];
    const ColumnTest test = child.problem->TestColumn(child.problem->FromParent(parent, point, tried, {}), parent, point, base);
    if (!test.valid) continue;
    constexpr double kAllAbsorbed = 0.999;
    best.visible = best.visible || test.absorbed < kAllAbsorbed;
    if (best.valid && test.drop <= best.drop * base.cost) continue;
    best.valid = true;
    best.drop = test.drop / base.cost;
    best.absorbed = test.absorbed;
    best.dy = test.dy;
    for (std::size_t i = 0; i < trial.size(); ++i) tried[model.IndexOf(placed.value()[i].name)] = StepTo(placed.value()[i], trial[i], test.scale);
    best.values = std::move(tried);
  }
  return best;
}

std::vector<Screened> Screen(const Workbench& bench, Candidate& parent, const std::vector<EffectUse>& uses) {
  std::vector<Screened> screened;
  const Snapshot base = parent.problem->Capture(parent.point, 0.01);
  if (!base.valid) return screened;
  for (const EffectUse& use : uses) {
    if (std::find(parent.effects.begin(), parent.effects.end(), use) != parent.effects.end()) continue;
    std::vector<EffectUse> effects = parent.effects;
    effects.push_back(use);
    auto made = MakeCandidate(bench, effects);
    if (!made.ok()) continue;
    Screened entry{.use = use, .trial = {}, .child = std::move(made).value()};
    entry.trial = TryEffect(bench, entry.child, use, *parent.problem, parent.point, base);
    if (entry.trial.valid) screened.push_back(std::move(entry));
  }
  std::stable_sort(screened.begin(), screened.end(), [](const Screened& a, const Screened& b) { return a.trial.drop > b.trial.drop; });
  return screened;
}

}  // namespace gapscope
