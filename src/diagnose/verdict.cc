#include "src/diagnose/verdict.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "src/diagnose/rules.h"

namespace gapscope {
namespace {

double Sigmoid(double x) { return 1 / (1 + std::exp(-x)); }

// The candidate that comes closest to the chosen one without containing it or being contained.
const Candidate* NearestRival(const Candidates& field, const Candidate& chosen) {
  const Candidate* nearest = nullptr;
  for (const auto& rival : field) {
    if (rival.get() == &chosen || rival->held_out_blocks.empty() || !MayBeRivals(*rival, chosen)) continue;
    if (!nearest || LogMisfit(*rival) < LogMisfit(*nearest)) nearest = rival.get();
  }
  return nearest;
}

// Whether a constant torque on the joint shows in nothing but the zero of its sensor, which nobody knows.
bool IsZeroOffset(const SearchResult& found, const std::string& joint) {
  constexpr double kImitated = 0.9999;
  for (const EffectUse& use : AllUses(*found.base->model->rig())) {
    const bool constant = EffectOf(use, *found.base->model->rig()).character == EffectCharacter::kConstantTorque;
    if (constant && use.on == joint && !IsFinding(use, *found.base->model)) return !found.torque;
  }
  return std::any_of(found.first.screen.begin(), found.first.screen.end(), [&](const Screened& s) {
    const bool constant = EffectOf(s.use, *found.base->model->rig()).character == EffectCharacter::kConstantTorque;
    return constant && s.use.on == joint && s.trial.valid && s.trial.absorbed > kImitated;
  });
}

// What could stand in the place of `use`, one of the chosen effects: rivals among `field`, and what is the same motion
// by definition.
void AddGroup(const SearchResult& found, const Candidates& field, const EffectUse& use,
              std::vector<std::vector<EffectUse>>* groups) {
  const Candidate& chosen = *found.chosen;
  std::vector<EffectUse> group = {use};
  for (const auto& rival : field) {
    const bool same =
        std::is_permutation(rival->effects.begin(), rival->effects.end(), chosen.effects.begin(), chosen.effects.end());
    if (!same && !rival->held_out_blocks.empty() && MayBeRivals(*rival, chosen) && AreRivals(chosen, *rival))
      group.push_back(rival->effects.back());
  }
  for (const auto& other : found.first.screen) {
    const bool known = std::find(group.begin(), group.end(), other.use) != group.end();
    const bool same = (found.one_signal && IsSameDelay(use, other.use, *found.base->model)) ||
                      (IsSameFriction(use, other.use, *found.base->model) && IsZeroOffset(found, use.on));
    if (!known && same) group.push_back(other.use);
  }
  if (group.size() > 1) groups->push_back(std::move(group));
}

// Probability that the verdict is right as a whole: logistic in what the banks of twin cases of seeds 910, 911 and 912
// showed to matter (scripts/blind/calibrate.py; 179 cases, so the weights are rounded).
double Confidence(Verdict verdict, const VerdictEvidence& e, std::size_t effects) {
  const double excess = std::log(std::max(e.floors_left, 1.0));
  switch (verdict) {
    case Verdict::kNone:
    case Verdict::kParameters:
      return Sigmoid(3.5);
    case Verdict::kEffects:
      return Sigmoid(1.7 + 2.0 * std::clamp(e.rival_lead, 0.0, 0.5) - 1.2 * excess - (effects > 1 ? 1.0 : 0));
    case Verdict::kAmbiguous:
      return Sigmoid(1.8 - 1.6 * excess);
    // A gap a hundred times the noise says no more than one of ten: bank 913 had two that were known effects which no
    // fit reached.
    case Verdict::kUnknown:
      return Sigmoid(0.7 * std::min(excess, 2.3) - std::max(e.removed, 0.0));
  }
  return 0;
}

}  // namespace

Judgement Judge(const SearchResult& found) {
  Judgement result;
  const Candidate &base = *found.base, &chosen = *found.chosen;
  const bool pair = chosen.effects.size() == 2;
  const Candidate& parent = pair ? *found.single : base;
  const Candidates& field = pair ? found.second.children : found.first.children;

  VerdictEvidence& e = result.evidence;
  e.floors_before = base.held_out_floors;
  e.floors_left = chosen.held_out_floors;
  const double excess = e.floors_before - std::min(1.0, e.floors_left);
  e.removed = e.floors_before > 1 ? (e.floors_before - e.floors_left) / excess : 0;
  e.free_run_before = found.free_run_before;
  e.free_run_left = found.free_run_left;
  if (std::isfinite(e.free_run_before) && std::isfinite(e.free_run_left) && e.free_run_before > 0)
    e.free_run_removed = 1 - e.free_run_left / e.free_run_before;
  const Candidate* best = &chosen != &base ? &chosen : field.empty() ? nullptr : field.front().get();
  if (best) {
    const Evidence gain = Compare(parent, *best);
    e.gain_train = gain.train;
    e.gain_held_out = gain.held_out;
    e.z = gain.z;
    if (const Candidate* rival = NearestRival(field, *best)) {
      const Evidence lead = Compare(*rival, *best);
      e.rival_lead = gain.gain > 0 ? lead.gain / gain.gain : 0;
      e.rival_z = lead.z;
    }
  }

  if (&chosen != &base) {
    AddGroup(found, field, chosen.effects.back(), &result.groups);
    if (pair) AddGroup(found, found.exchange.children, chosen.effects.front(), &result.groups);
  }
  const auto [less, more] = std::minmax(e.removed, e.free_run_removed);
  if (e.floors_left > kUnknownFloors && more < kUnknownRemoved && less < kUnknownRemovedInBoth) {
    result.verdict = Verdict::kUnknown;
  } else if (&chosen == &base) {
    result.verdict = Convincing(Compare(*found.nominal, base), kRetuned) ? Verdict::kParameters : Verdict::kNone;
  } else {
    result.verdict = result.groups.empty() ? Verdict::kEffects : Verdict::kAmbiguous;
  }
  result.probability = Confidence(result.verdict, e, chosen.effects.size());
  // Of bank 917's verdicts at the end of the budget as many were right as of the others like them; but of leaders that
  // no fit has looked at nothing is known.
  if (found.first.refitted < found.first.leaders.size()) result.probability *= 0.8;

  // Single explanations share the verdict's probability by how close they come to the leader.
  const Candidate* leader = found.single;
  result.explanations.push_back(&base);
  for (const auto& child : found.first.children) result.explanations.push_back(child.get());
  std::vector<double> odds;
  for (const Candidate* c : result.explanations) {
    const Evidence lead = Compare(*c, *leader);
    constexpr double kBehind = 0.9, kRicher = 0.2;  // none comes before the leader; what only adds to it hardly counts
    const double odd = std::exp(-0.5 * std::max(0.0, lead.z) - 20 * std::max(0.0, lead.held_out));
    odds.push_back(c == leader ? 0 : odd * (Contains(*c, *leader) ? kRicher : kBehind));
  }
  const double others = std::accumulate(odds.begin(), odds.end(), 0.0);
  const bool told = result.verdict != Verdict::kUnknown && result.verdict != Verdict::kAmbiguous;
  const double own = told ? std::max(result.probability, 1 / (1 + others)) : 1 / (1 + others);
  for (std::size_t i = 0; i < odds.size(); ++i) {
    result.probabilities.push_back(result.explanations[i] == leader ? (others > 0 ? own : 1)
                                                                    : odds[i] / others * (1 - own));
  }
  return result;
}

}  // namespace gapscope
