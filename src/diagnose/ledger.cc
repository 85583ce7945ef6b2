#include "src/diagnose/ledger.h"

#include <algorithm>
#include <cmath>

#include "src/core/statistics.h"
#include "src/diagnose/policy.h"

namespace gapscope {
namespace {

// After the time that was asked for no fit goes far: judging is not cut, so it must not take long.
FitLimits LimitsOf(Effort effort, bool time_is_over) {
  switch (time_is_over ? Effort::kTaste : effort) {
    case Effort::kTaste:
      return {.iterations = 2, .tolerance = 1e-2};
    case Effort::kTry:
      return {.iterations = 10, .tolerance = 3e-3};
    case Effort::kFinish:
      break;
  }
  return {.iterations = 40, .tolerance = 2e-4};
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

// In all Jacobians.
double NumbersIn(const std::deque<Candidate*>& candidates) {
  double numbers = 0;
  for (const Candidate* candidate : candidates) {
    if (!candidate->derivatives) continue;
    for (const auto& jacobian : candidate->derivatives->jacobians) numbers += static_cast<double>(jacobian.size());
  }
  return numbers;
}

bool IsPart(const EffectSet& small, const EffectSet& large) {
  return small.size() < large.size() && std::includes(large.begin(), large.end(), small.begin(), small.end());
}

}  // namespace

EffectSet Without(const EffectSet& set, const EffectUse& use) {
  EffectSet rest = set;
  std::erase(rest, use);
  return rest;
}

EffectSet Without(const EffectSet& set, const std::vector<EffectUse>& uses) {
  EffectSet rest = set;
  for (const EffectUse& use : uses) std::erase(rest, use);
  return rest;
}

EffectSet With(const EffectSet& set, const EffectUse& use) {
  EffectSet more = set;
  more.insert(std::lower_bound(more.begin(), more.end(), use), use);
  return more;
}

Candidate* Ledger::Find(const EffectSet& set) const {
  const auto place = fitted_.find(set);
  return place == fitted_.end() || !std::isfinite(place->second->train_cost) ? nullptr : place->second.get();
}

Candidate* Ledger::FindOrTry(const EffectSet& set, const Candidate& from) {
  Candidate* fitted = Find(set);
  return fitted ? fitted : Refit(set, from, {}, {}, Effort::kTry);
}

std::vector<Candidate*> Ledger::All() const {
  std::vector<Candidate*> all;
  for (const auto& [set, candidate] : fitted_) {
    if (std::isfinite(candidate->train_cost)) all.push_back(candidate.get());
  }
  return all;
}

// Keeps the fit if it ends below the candidate's. Above that and `reach` it goes on only as fast as would lead below.
void Ledger::Try(Candidate* candidate, const Start& start, Effort effort, double reach) {
  if (!std::isfinite(start.cost)) return;
  const double known = candidate->train_cost;
  const FitPoint before = candidate->point;
  const std::vector<double> values = candidate->values;
  const auto limbs = candidate->train_limbs;
  const bool converged = candidate->converged, scored = candidate->scored;
  const StampShift stamps = candidate->stamps;
  const auto derivatives = candidate->derivatives;
  FitLimits limits = LimitsOf(effort, bench_.TimeIsOver());
  // An effect that is not there costs nothing more, so that a part's cost is within reach.
  const Candidate* part = BestSubset(*candidate);
  limits.least_known = std::min({start.cost, known, part ? part->train_cost : kInfinity});
  const double goal = std::min(known, reach);
  FitCandidate(bench_, candidate, start.point, limits, start.cost > goal ? TooSlow(goal, limits.iterations) : GiveUp{},
               start.from);
  Remember(candidate);
  if (candidate->train_cost < known) {
    // To the end with what is known counted as against the residuals that are left.
    constexpr double kMuchLess = 0.5;
    if (effort == Effort::kFinish && candidate->train_cost < kMuchLess * limits.least_known)
      Try(candidate, {.point = candidate->point, .cost = candidate->train_cost}, effort, reach);
    return;
  }
  candidate->point = before;
  candidate->values = values;
  candidate->train_cost = known;
  candidate->train_limbs = limbs;
  candidate->converged = converged;
  candidate->scored = scored;
  candidate->stamps = stamps;
  candidate->derivatives = derivatives;
}

void Ledger::Remember(Candidate* candidate) {
  std::erase(remembered_, candidate);
  remembered_.push_back(candidate);
  const auto forget = [&](const auto& at) {
    (*at)->derivatives.reset();
    remembered_.erase(at);
  };
  if (remembered_.size() > kDiagnosePolicy.search.jacobians) forget(remembered_.begin());
  // The first one is the base model's, which most sets begin with.
  constexpr std::size_t kLeast = 3;
  while (remembered_.size() > kLeast && NumbersIn(remembered_) > kDiagnosePolicy.search.jacobian_numbers)
    forget(std::next(remembered_.begin()));
}

Candidate* Ledger::Refit(const EffectSet& set, const Candidate& from, const std::map<std::string, double>& values,
                         const Eigen::VectorXd& dy, Effort effort) {
  auto& place = fitted_[set];
  if (!place) {
    auto made = MakeCandidate(bench_, set);
    place = std::make_unique<Candidate>();
    place->train_cost = kInfinity;
    if (!made.ok()) return nullptr;
    *place = std::move(made).value();
    place->train_cost = kInfinity;
    place->train_limbs = {{kInfinity, 0}};
  }
  if (!place->problem) return nullptr;
  Candidate& candidate = *place;
  std::vector<double> all = bench_.Nominal(*candidate.model);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string& name = candidate.model->parameters()[i].name;
    if (const int index = from.model->IndexOf(name); index >= 0) all[i] = from.values[index];
    if (const auto given = values.find(name); given != values.end()) all[i] = given->second;
  }
  Try(&candidate, StartFrom(candidate, from, all, dy), effort);
  if (std::isfinite(candidate.train_cost)) StartFromOtherShapes(&candidate, from, effort);
  if (const Candidate* part = BestSubset(candidate); part && part->train_cost < candidate.train_cost)
    Try(&candidate, StartFromSubset(candidate, *part), effort);
  return std::isfinite(candidate.train_cost) ? &candidate : nullptr;
}

// With as much of the other one's answer as pays: far outside of where it was linear it leads along valleys.
Ledger::Start Ledger::StartFrom(const Candidate& candidate, const Candidate& from, const std::vector<double>& values,
                                const Eigen::VectorXd& dy) const {
  Start best{.from = &from, .cost = kInfinity};
  for (const double share : {1.0, 0.0}) {
    if (share > 0 && dy.size() != from.point.y.size()) continue;
    FitPoint moved = from.point;
    if (share > 0) moved.y = (moved.y + dy).cwiseMax(from.problem->layout().low).cwiseMin(from.problem->layout().high);
    FitPoint start = CarryOver(*from.problem, moved, *candidate.problem, values);
    const double there = CostAt(bench_, candidate, start);
    if (there < best.cost) best.point = std::move(start), best.cost = there;
  }
  return best;
}

void Ledger::Clear() {
  remembered_.clear();
  fitted_.clear();
}

void Ledger::Continue(Candidate* candidate, Effort effort, double reach) {
  Try(candidate, {.point = candidate->point, .cost = candidate->train_cost}, effort, reach);
}

void Ledger::TryWith(Candidate* candidate, const std::vector<double>& values, Effort effort) {
  FitPoint point = candidate->problem->At(values, candidate->point);
  const double cost = CostAt(bench_, *candidate, point);
  Try(candidate, {.point = std::move(point), .cost = cost}, effort);
}

void Ledger::LookAside(Candidate* candidate) {
  constexpr double kAside = 1.25;
  for (const EffectUse& use : candidate->effects) {
    if (EffectOf(use, *bench_.rig).character != EffectCharacter::kSecondMass) continue;
    const PlacedParameter size = PlacedParameters(use, *bench_.rig, bench_.scales).front();
    const auto i = static_cast<std::size_t>(candidate->model->IndexOf(size.name));
    for (const double factor : {kAside, 1 / kAside}) {
      std::vector<double> values = candidate->values;
      values[i] = std::clamp(factor * values[i], size.low, size.high);
      TryWith(candidate, values, Effort::kFinish);
    }
  }
}

void Ledger::StartFromOtherShapes(Candidate* candidate, const Candidate& from, Effort effort) {
  constexpr double kLeft = 0.05;  // of the size that another shape took over
  for (const EffectUse& use : candidate->effects) {
    if (Has(from.effects, use)) continue;
    const auto& parameters = EffectOf(use, *bench_.rig).parameters;
    const auto shape = std::find_if(parameters.begin(), parameters.end(), [](const auto& p) { return p.takes_over; });
    const auto scales = bench_.scales.find(use.on);
    if (shape == parameters.end() || scales == bench_.scales.end()) continue;
    const auto placed = PlacedParameters(use, *bench_.rig, bench_.scales);
    const auto index = [&](std::size_t i) {
      return static_cast<std::size_t>(candidate->model->IndexOf(placed[i].name));
    };
    const auto s = static_cast<std::size_t>(shape - parameters.begin());
    std::vector<double> values = candidate->values;
    const double size = values[index(0)], of_size = ScaleOf(parameters[0].scale, scales->second),
                 of_shape = ScaleOf(shape->scale, scales->second);
    values[index(0)] = kLeft * size;
    values[index(s)] = std::clamp(values[index(s)] + size / of_size * of_shape, placed[s].low, placed[s].high);
    TryWith(candidate, values, std::max(effort, Effort::kTry));
  }
}

const Candidate* Ledger::BestSubset(const Candidate& candidate) const {
  const Candidate* best = nullptr;
  for (const auto& [set, other] : fitted_) {
    if (other->problem && IsPart(set, candidate.effects) && (!best || other->train_cost < best->train_cost))
      best = other.get();
  }
  return best;
}

// What the subset lacks begins small.
Ledger::Start Ledger::StartFromSubset(const Candidate& candidate, const Candidate& part) const {
  std::vector<double> values = bench_.Nominal(*candidate.model);
  for (const auto& use : candidate.effects) {
    if (Has(part.effects, use)) continue;
    for (const auto& p : PlacedParameters(use, *bench_.rig, bench_.scales)) {
      constexpr double kSmall = 0.1;
      double& value = values[candidate.model->IndexOf(p.name)];
      value = p.trials.empty() || p.role == ParameterRole::kPlace ? p.start
                                                                  : p.neutral + kSmall * (p.trials.front() - p.neutral);
    }
  }
  Start start{.point = CarryOver(*part.problem, part.point, *candidate.problem, values), .from = &part};
  start.cost = CostAt(bench_, candidate, start.point);
  return start;
}

}  // namespace gapscope
