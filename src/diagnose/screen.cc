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

}  // namespace

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
    Screened entry{.use = use, .child = std::move(made).value()};
    const Model& model = *entry.child.model;
    const auto placed = model.EffectParameters(use, bench.scales);
    if (!placed.ok()) continue;
    std::vector<double> values = model.Nominal();
    for (std::size_t i = 0; i < parent.values.size(); ++i) {
      if (const int index = model.IndexOf(parent.model->parameters()[i].name); index >= 0) values[index] = parent.values[i];
    }
    bool first = true;
    for (const auto& trial : Trials(placed.value())) {
      std::vector<double> tried = values;
      for (std::size_t i = 0; i < trial.size(); ++i) tried[model.IndexOf(placed.value()[i].name)] = trial[i];
      // A late command replaces the nuisance shift: it starts from there.
      const FitPoint point = entry.child.problem->FromParent(*parent.problem, parent.point, tried, {});
      const ColumnTest test = entry.child.problem->TestColumn(point, *parent.problem, base);
      if (!test.valid) continue;
      if (test.absorbed < 0.999) entry.visible = true;
      if (!first && test.drop <= entry.drop * base.cost) continue;
      first = false;
      entry.drop = test.drop / base.cost;
      entry.absorbed = test.absorbed;
      entry.dy = test.dy;
      entry.values = tried;
      // The step that the test asks for: of the parameters that carry the effect's size.
      for (std::size_t i = 0; i < trial.size(); ++i) {
        const auto& p = placed.value()[i];
        if (p.trials.empty() || p.key.find("rest") != std::string::npos || p.key.find("phase") != std::string::npos || p.key.find("periods") != std::string::npos) continue;
        const double scale = std::clamp(test.scale, 0.3, 2.0);
        const double target = p.neutral == p.high ? trial[i] : p.neutral + scale * (trial[i] - p.neutral);
        entry.values[model.IndexOf(p.name)] = std::clamp(target, p.low, p.high);
      }
    }
    if (first) continue;
    screened.push_back(std::move(entry));
  }
  std::stable_sort(screened.begin(), screened.end(), [](const Screened& a, const Screened& b) { return a.drop > b.drop; });
  return screened;
}

}  // namespace gapscope
