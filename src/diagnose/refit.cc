#include "src/diagnose/refit.h"

#include <algorithm>
#include <cmath>

#include "src/core/statistics.h"
#include "src/diagnose/rules.h"

namespace gapscope {
namespace {

constexpr int kFirstIterations = 14, kTasteIterations = 4;
constexpr double kFirstTolerance = 2e-3;
constexpr double kWorthImitating = 0.8;  // a leader that leaves less than this share of its parent's cost

constexpr double kFarBehind = 3;  // times the best cost, at which a fit is given up after a fair try

GiveUp FarBehind(double best_cost) {
  constexpr int kFairTry = 4;
  return [=](double cost, int iteration) { return iteration >= kFairTry && cost > kFarBehind * best_cost; };
}

// Gives up where the better of the last two gains, made again in each iteration left, would not lead below `known`.
GiveUp TooSlow(double known, int iterations) {
  double last = kInfinity, gained = last;
  return [=](double cost, int iteration) mutable {
    const double gain = last - cost, best = std::max(gain, gained);
    last = cost;
    gained = gain;
    return iteration > 1 && cost - best * (iterations - iteration) > known;
  };
}

// A fit from a start of its own, kept if it ends below the candidate's.
void TryStart(const Workbench& bench, Candidate* candidate, const FitPoint& start, int iterations, double tolerance) {
  if (!std::isfinite(candidate->problem->Evaluate(start, Keep::kCost).cost)) return;
  const FitPoint before = candidate->point;
  const double cost = candidate->train_cost;
  const bool converged = candidate->converged;
  FitCandidate(bench, candidate, start, iterations, tolerance, TooSlow(cost, iterations));
  if (candidate->train_cost < cost) return;
  candidate->point = before;
  candidate->train_cost = cost;
  candidate->converged = converged;
  candidate->values = candidate->problem->Values(before);
  candidate->shift_s = candidate->problem->Shift(before);
}

// The trial's values with as much of the parent's answer as pays: far outside of where it was linear it leads along
// valleys that take many Jacobians back.
FitPoint StartFrom(const FitProblem& parent, const FitPoint& at, const Trial& trial, FitProblem* child) {
  FitPoint best;
  double least = kInfinity;
  for (const double share : {1.0, 0.3, 0.0}) {
    FitPoint start = FromParent(parent, at, *child, trial.values, share * trial.dy);
    const double cost = child->Evaluate(start, Keep::kCost).cost;
    if (best.y.size() > 0 && !(cost < least)) continue;
    least = cost;
    best = std::move(start);
  }
  return best;
}

}  // namespace

void TasteChild(const Workbench& bench, const Candidate& parent, const Trial& trial, Candidate* child) {
  FitCandidate(bench, child, StartFrom(*parent.problem, parent.point, trial, child->problem.get()), kTasteIterations,
               kFirstTolerance);
  for (const Trial& other : trial.others) {
    if (!bench.Late())
      TryStart(bench, child, StartFrom(*parent.problem, parent.point, other, child->problem.get()), kTasteIterations,
               kFirstTolerance);
  }
}

void FinishChild(const Workbench& bench, const Candidate& parent, const EffectUse& use, const Trial& trial,
                 double best_cost, Candidate* child) {
  if (!child->converged && !(child->train_cost > kFarBehind * best_cost))
    FitCandidate(bench, child, child->point, kFirstIterations, kFirstTolerance, FarBehind(best_cost));
  if (child->train_cost <= parent.train_cost * 1.0005 || bench.Late()) return;
  std::vector<double> neutral = trial.values;
  for (const auto& p : PlacedParameters(use, *bench.rig, bench.scales))
    neutral[child->model->IndexOf(p.name)] = p.neutral + 0.02 * ((p.neutral == p.high ? p.low : p.high) - p.neutral);
  TryStart(bench, child, CarryOver(*parent.problem, parent.point, *child->problem, neutral), kFirstIterations,
           kFirstTolerance);
}

void StartFromValues(const Workbench& bench, const std::vector<double>& values, Candidate* candidate) {
  TryStart(bench, candidate, candidate->problem->At(values, candidate->problem->Start()), kFirstIterations,
           kFirstTolerance);
}

void ImitateLeader(const Workbench& bench, Candidate& parent, Layer* layer) {
  constexpr std::size_t kMost = 3;
  Candidate& leader = *layer->children.front();
  if (!(leader.train_cost < kWorthImitating * parent.train_cost) || bench.Late()) return;
  const FitPoint at = CarryOver(*leader.problem, leader.point, *parent.problem, leader.model->Nominal());
  const Snapshot snapshot = Capture(*parent.problem, at, 0.01);
  if (!snapshot.valid) return;
  std::size_t tried = 0;
  for (std::size_t i = 1; i < layer->children.size() && tried < kMost && !bench.Late(); ++i) {
    Candidate& rival = *layer->children[i];
    if (!ArePartners(leader.effects.back(), rival.effects.back(), *parent.model) ||
        (rival.train_cost < 1.02 * leader.train_cost && !Contains(rival, leader)))
      continue;
    const Trial trial = TryEffect(bench, rival, rival.effects.back(), *parent.problem, at, snapshot);
    if (!trial.valid) continue;
    ++tried;
    const FitPoint start = StartFrom(*parent.problem, at, trial, rival.problem.get());
    TryStart(bench, &rival, start, kFirstIterations, kFirstTolerance);
    ScoreCandidate(bench, &rival);
  }
}

void VaryShape(const Workbench& bench, const Candidate& parent, Candidate* candidate) {
  const auto placed = PlacedParameters(candidate->effects.back(), *bench.rig, bench.scales);
  constexpr double kFar = 4;  // times the value found
  for (const auto& p : placed) {
    if (!(p.low < p.high)) continue;
    const int index = candidate->model->IndexOf(p.name);
    std::vector<double> values = candidate->values;
    if (p.trials.empty()) {
      // On the other side of the middle.
      const double found = values[index],
                   middle = p.low > 0 && p.high > 20 * p.low ? std::sqrt(p.low * p.high) : 0.5 * (p.low + p.high);
      values[index] = found > middle ? p.low + 0.4 * (middle - p.low) : middle + 0.4 * (p.high - middle);
      if (!bench.Late())
        TryStart(bench, candidate, candidate->problem->At(values, candidate->point), kFirstIterations, kFirstTolerance);
    } else if (placed.front().name == p.name && p.trials.size() < kScan) {
      // Of another order of size, from the parent: with this one the base parameters may have gone where no step leads
      // back.
      for (const double trial : p.trials) {
        const double ratio = trial / candidate->values[index];
        if (bench.Late() || (ratio > 1 / kFar && ratio < kFar)) continue;
        values = candidate->model->Nominal();
        for (const auto& q : placed) values[candidate->model->IndexOf(q.name)] = q.start;
        values[index] = trial;
        TryStart(bench, candidate, CarryOver(*parent.problem, parent.point, *candidate->problem, values),
                 kTasteIterations, kFirstTolerance);
      }
    }
  }
}

void FinishRivals(const Workbench& bench, const Candidate& parent, Layer* layer) {
  constexpr double kMuch = 0.3;  // of the parent's cost
  for (const auto& child : layer->children) {
    if (bench.Late()) return;
    if (child->converged || !(child->train_cost < (1 - kMuch) * parent.train_cost)) continue;
    FitCandidate(bench, child.get(), child->point, kFinalIterations, kFinalTolerance);
    VaryShape(bench, parent, child.get());
    ScoreCandidate(bench, child.get());
  }
}

void StartFromSimpler(const Workbench& bench, Layer* layer) {
  constexpr double kClearlyBetter = 0.9;
  for (const auto& simple : layer->children) {
    if (simple->held_out_floors < kRemains) continue;
    const EffectUse& from = simple->effects.back();
    const double size =
        simple->values[simple->model->IndexOf(PlacedParameters(from, *bench.rig, bench.scales).front().name)];
    for (const auto& rich : layer->children) {
      const EffectUse& use = rich->effects.back();
      const StartsFrom& known = EffectOf(use, *bench.rig).starts_from;
      if (known.effect != from.effect || use.on != from.on) continue;
      // One start is for what lags behind; several are for what has several valleys, wherever it is.
      const bool ahead = known.starts.size() == 1 &&
                         (!Contains(*rich, *simple) || rich->train_cost < kClearlyBetter * simple->train_cost);
      if (ahead || bench.Late()) continue;
      const auto placed = PlacedParameters(use, *bench.rig, bench.scales);
      for (const auto& start : known.starts) {
        if (bench.Late()) return;
        std::vector<double> values = rich->model->Nominal();
        for (std::size_t i = 0; i < placed.size(); ++i) {
          const bool stated = start[i].of_simpler != 0 || start[i].value != 0;
          values[rich->model->IndexOf(placed[i].name)] =
              stated ? start[i].of_simpler * size + start[i].value : placed[i].start;
        }
        TryStart(bench, rich.get(), CarryOver(*simple->problem, simple->point, *rich->problem, values),
                 kFirstIterations, kFirstTolerance);
      }
      ScoreCandidate(bench, rich.get());
    }
  }
}

}  // namespace gapscope
