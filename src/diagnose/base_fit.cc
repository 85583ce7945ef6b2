#include "src/diagnose/base_fit.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "src/diagnose/policy.h"
#include "src/diagnose/torques.h"

namespace gapscope {
namespace {

// Base parameters that ended on a bound get as much room again beyond it: an effect must not stand in for a value
// that the experiment file happens to exclude. Zero is a bound of physics. False: there are none.
bool WidenBounds(const Workbench& bench, const Candidate& base) {
  bool widened = false;
  for (const Coordinate& c : base.problem->space().coordinates()) {
    const Parameter& p = base.problem->space().parameter(c);
    const OnBound bound = BoundOf(base.values[static_cast<std::size_t>(c.parameter)], p.low, p.high);
    if (bound == OnBound::kNo || (bound == OnBound::kLow && p.low == 0)) continue;
    const double factor = p.low > 0 ? p.high / p.low : 0, width = p.high - p.low;
    const double low = p.low > 0 ? p.low / factor : p.low - width, high = p.low > 0 ? p.high * factor : p.high + width;
    (*bench.bounds)[p.name] = {bound == OnBound::kLow ? low : p.low, bound == OnBound::kHigh ? high : p.high};
    widened = true;
  }
  return widened;
}

Status Fit(const Workbench& bench, const Say& say, SearchResult* result) {
  say("refitting the baseline");
  GS_ASSIGN(Candidate nominal, MakeCandidate(bench, {}));
  nominal.point = nominal.problem->Start();
  nominal.train_cost = nominal.problem->Evaluate(nominal.point, Keep::kCost).cost;
  if (!std::isfinite(nominal.train_cost)) {
    return Error{.what = "the base model cannot be simulated along these logs, even in windows",
                 .where = bench.rig->experiment().path,
                 .cure = "check units, signs and nominal parameters with `gapscope replay --mode windows`"};
  }
  ScoreCandidate(bench, &nominal);
  MeasureCoupling(bench, nominal);
  result->nominal = std::make_unique<Candidate>(std::move(nominal));
  result->base = result->ledger.Refit({}, *result->nominal, {}, {}, Effort::kFinish);
  for (std::size_t round = 0; round < kDiagnosePolicy.search.widenings && WidenBounds(bench, *result->base); ++round) {
    GS_ASSIGN(Candidate wider, MakeCandidate(bench, {}));
    wider.values = result->base->values;
    wider.point = CarryOver(*result->base->problem, result->base->point, *wider.problem, wider.values);
    result->ledger.Clear();
    result->base = result->ledger.Refit({}, wider, {}, {}, Effort::kFinish);
  }
  ScoreCandidate(bench, result->base);
  result->chosen = result->base;
  const std::set<std::string> out_of_sight = JointsOutOfSight(*result->base->model, bench.data->train);
  for (const auto& use : AllUses(*bench.rig)) {
    if (Has(bench.known, use) || IsOfMissingSensor(use, *bench.rig, result->logged)) continue;
    if (!IsFinding(use, *result->base->model)) continue;
    const EffectPlace place = EffectOf(use, *bench.rig).place;
    const bool of_joint = place == EffectPlace::kJoint || place == EffectPlace::kSpringJoint;
    (of_joint && out_of_sight.contains(use.on) ? result->out_of_sight : result->uses).push_back(use);
  }
  return Ok();
}

}  // namespace

void MeasureCoupling(const Workbench& bench, Candidate& at) {
  constexpr std::size_t kFew = 2;
  if (bench.rig->Actuators().size() <= kFew) return;
  const std::vector<ProbeTorque> torques = MakeTorques(bench);
  const auto other = [&](const ProbeTorque& torque) { return torque.joint != torques.front().joint; };
  if (std::none_of(torques.begin(), torques.end(), other)) return;
  *bench.coupling = Coupling::Measure(*at.problem, at.point, torques, bench.work.get());
}

Result<std::unique_ptr<SearchResult>> FitBase(const Workbench& bench, const Say& say) {
  auto result = std::make_unique<SearchResult>(bench);
  result->logged = WhatIsLogged(bench.data->train);
  GS_RETURN_IF_ERROR(Fit(bench, say, result.get()));
  const double train_floors = std::sqrt(
      2 * result->base->train_cost / static_cast<double>(std::max<std::size_t>(1, result->base->problem->residuals())));
  constexpr double kUneven = 1.5;
  result->uneven =
      std::max(train_floors / result->base->held_out_floors, result->base->held_out_floors / train_floors) > kUneven;
  return result;
}

}  // namespace gapscope
