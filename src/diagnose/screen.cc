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

// Where the test asks the parameters that carry the effect's size to go; a place (rest, phase, periods) stays on its
// trial value.
double StepTo(const PlacedParameter& p, double trial, double scale) {
  constexpr double kLeastScale = 0.3, kMostScale = 2;
  if (p.trials.empty() || p.role == ParameterRole::kPlace || p.neutral == p.high) return trial;
  return std::clamp(p.neutral + std::clamp(scale, kLeastScale, kMostScale) * (trial - p.neutral), p.low, p.high);
}

constexpr std::size_t kOthers = 3;

// The best of `trials` (one per value of the scanned parameter `scanned`), with the next best that are no neighbours of
// it or each other.
Trial BestOfScan(std::vector<Trial> trials, int scanned) {
  std::stable_sort(trials.begin(), trials.end(), [](const Trial& a, const Trial& b) { return a.drop > b.drop; });
  constexpr double kNeighbour = 1.5, kFarBehind = 0.4;
  Trial best = trials.front();
  for (std::size_t i = 1; i < trials.size() && best.others.size() < kOthers && trials[i].drop > kFarBehind * best.drop;
       ++i) {
    const auto near = [&](const Trial& t) {
      return std::abs(t.values[scanned] - trials[i].values[scanned]) < kNeighbour;
    };
    if (!near(best) && std::none_of(best.others.begin(), best.others.end(), near)) best.others.push_back(trials[i]);
  }
  return best;
}

// The trials of one effect against one snapshot.
struct Tests {
  std::vector<Trial> best;  // one per scanned value; without a scan, one
  int scan = -1;            // index of the scanned parameter in the model
  bool visible = false;
};

void Test(Candidate& child, const std::vector<PlacedParameter>& placed, const std::vector<std::vector<double>>& trials,
          const FitProblem& parent, const FitPoint& point, const Snapshot& base, Tests* tests) {
  const Model& model = *child.model;
  const std::vector<double> nominal = model.Nominal();
  tests->best.clear();
  for (const auto& trial : trials) {
    std::vector<double> tried = nominal;
    for (std::size_t i = 0; i < trial.size(); ++i) tried[model.IndexOf(placed[i].name)] = trial[i];
    const ColumnTest test =
        TestColumn(*child.problem, CarryOver(parent, point, *child.problem, tried), parent, point, base);
    if (!test.valid) continue;
    constexpr double kAllAbsorbed = 0.999,
                     kPromises = 0.05;  // little of a column may be its own and yet be what is missing
    tests->visible = tests->visible || test.absorbed < kAllAbsorbed || test.drop > kPromises * base.cost;
    for (std::size_t i = 0; i < trial.size(); ++i) {
      tried[model.IndexOf(placed[i].name)] = StepTo(placed[i], trial[i], test.scale);
      if (placed[i].trials.size() >= kScan) tests->scan = model.IndexOf(placed[i].name);
    }
    Trial found{.drop = test.drop / base.cost,
                .absorbed = test.absorbed,
                .trial = trial,
                .values = std::move(tried),
                .dy = test.dy,
                .valid = true,
                .others = {}};
    const auto same = std::find_if(tests->best.begin(), tests->best.end(), [&](const Trial& t) {
      return tests->scan < 0 || t.values[tests->scan] == found.values[tests->scan];
    });
    if (same == tests->best.end()) {
      tests->best.push_back(std::move(found));
    } else if (found.drop > same->drop) {
      *same = std::move(found);
    }
  }
}

}  // namespace

Trial TryEffect(const Workbench& bench, Candidate& child, const EffectUse& use, FitProblem& parent,
                const FitPoint& point, const Snapshot& base) {
  const auto placed = PlacedParameters(use, *bench.rig, bench.scales);
  constexpr std::size_t kFewWindows = 8, kThin = 4;
  std::vector<std::vector<double>> trials = Trials(placed);
  Tests tests;
  if (std::any_of(placed.begin(), placed.end(), [](const PlacedParameter& p) { return p.trials.size() >= kScan; })) {
    Test(child, placed, trials, parent, point,
         Thin(parent, base, point, std::max(kFewWindows, parent.windows().size() / kThin)), &tests);
    if (tests.best.empty()) return {};
    const Trial best = BestOfScan(std::move(tests.best), tests.scan);
    trials = {best.trial};
    for (const Trial& other : best.others) trials.push_back(other.trial);
  }
  Test(child, placed, trials, parent, point, base, &tests);
  if (tests.best.empty()) return {};
  Trial result = tests.scan < 0 ? std::move(tests.best.front()) : BestOfScan(std::move(tests.best), tests.scan);
  result.visible = tests.visible;
  return result;
}

std::vector<Screened> Screen(const Workbench& bench, Candidate& parent, const std::vector<EffectUse>& uses) {
  std::vector<Screened> screened;
  const Snapshot base = Capture(*parent.problem, parent.point, 0.01);
  if (!base.valid) return screened;
  for (const EffectUse& use : uses) {
    if (std::find(parent.effects.begin(), parent.effects.end(), use) != parent.effects.end()) continue;
    std::vector<EffectUse> effects = parent.effects;
    effects.push_back(use);
    auto made = MakeCandidate(bench, effects);
    Screened entry{.use = use, .trial = {}, .child = {}, .left_out = {}};
    if (made.ok()) {
      entry.child = std::move(made).value();
      entry.trial = TryEffect(bench, entry.child, use, *parent.problem, parent.point, base);
      if (!entry.trial.valid) entry.left_out = "cannot be simulated along these logs at any trial value";
    } else {
      entry.left_out = "cannot be added: " + made.error().Text();
    }
    screened.push_back(std::move(entry));
  }
  std::stable_sort(screened.begin(), screened.end(), [](const Screened& a, const Screened& b) {
    return a.left_out.empty() != b.left_out.empty() ? a.left_out.empty() : a.trial.drop > b.trial.drop;
  });
  return screened;
}

}  // namespace gapscope
