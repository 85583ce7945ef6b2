#include "src/diagnose/evidence.h"

#include <algorithm>
#include <cmath>

#include "src/core/collect.h"
#include "src/core/statistics.h"
#include "src/diagnose/block_errors.h"
#include "src/diagnose/discrepancy.h"
#include "src/diagnose/policy.h"

namespace gapscope {
namespace {

double LogRatio(double before, double after) {
  const double most = kDiagnosePolicy.evidence.most_gain;
  if (std::isinf(after)) return std::isinf(before) ? kNaN : -most;
  return std::isinf(before) ? most : std::log(before / std::max(after, 1e-300));
}

// Errors of free runs as a gain; both beyond their signal: the motion was lost either way.
double FreeGain(double before, double after) {
  constexpr double kLost = 1;
  return std::min(before, after) > kLost ? kNaN : 2 * LogRatio(before, after);
}

// What the held-out logs gain, over its standard error: half seconds are independent.
double ClearBy(const Workbench& bench, const Candidate& without, const Candidate& with) {
  const auto weight = [&](std::size_t log, std::size_t signal) {
    const double w = bench.weights[bench.data.held_out[log].measured[signal].index];
    return w * w;
  };
  BlockSquares gains = SquaresByBlock(without.held_out, weight);
  for (const auto& [block, square] : SquaresByBlock(with.held_out, weight)) gains[block] -= square;
  const auto values = Collect(gains, [](const auto& entry) { return entry.second; });
  const Moments moments = MomentsOf(values);
  return moments.deviation > 0 ? std::sqrt(static_cast<double>(values.size())) * moments.mean / moments.deviation : 0;
}

}  // namespace

Evidence::Evidence(const Workbench& bench, SearchResult& found)
    : bench_(bench), found_(found), torques_(MakeTorques(bench)), free_left_(FreeRunError(bench, *found.chosen)) {
  ScoreCandidate(bench_, found_.chosen);
}

void Evidence::Choose(Candidate* candidate) {
  found_.ledger.Continue(candidate, Effort::kFinish);
  ScoreCandidate(bench_, candidate);
  found_.chosen = candidate;
  free_left_ = FreeRunError(bench_, *candidate);
}

// Only chosen sets are fitted to the end.
void Evidence::Compare(Candidate* candidate) {
  if (candidate->converged || !compared_.insert(candidate).second) return;
  found_.ledger.Continue(candidate, Effort::kTry, FarBehind(*found_.chosen));
}

void Evidence::SetCharacter(const std::vector<EffectUse>& uses, StatementNumbers* numbers) const {
  const auto all = [&](const auto& is) {
    return std::all_of(uses.begin(), uses.end(), [&](const EffectUse& use) { return is(EffectOf(use, *bench_.rig)); });
  };
  numbers->dry = all([](const Effect& effect) { return effect.character == EffectCharacter::kDryFriction; });
  numbers->smooth = all([](const Effect& effect) { return effect.of_motion; });
}

StatementNumbers Evidence::Of(const std::vector<EffectUse>& uses) {
  const EffectSet rest = Without(found_.chosen->effects, uses);
  Candidate* without = found_.ledger.Find(rest);
  if (!without || uses.size() > 1) without = found_.ledger.Refit(rest, *found_.chosen, {}, {}, Effort::kTry);
  return Of(uses, without ? without : found_.base);
}

StatementNumbers Evidence::Of(const std::vector<EffectUse>& uses, Candidate* without) {
  Compare(without);
  ScoreCandidate(bench_, without);
  StatementNumbers numbers;
  numbers.gain = LogRatio(without->TrainAboveNoise(), found_.chosen->TrainAboveNoise());
  numbers.gain_held_out = LogRatio(without->HeldOutAboveNoise(), found_.chosen->HeldOutAboveNoise());
  numbers.gain_free = FreeGain(FreeRunError(bench_, *without), free_left_);
  numbers.clear = ClearBy(bench_, *without, *found_.chosen);
  SetCharacter(uses, &numbers);
  if (torques_.empty()) return numbers;
  const ColumnTable table = MakeColumns(bench_, *without, {}, torques_);
  if (!table.valid || !Left().valid) return numbers;
  const std::size_t residuals = without->problem->residuals();
  numbers.discrepancy = TorquesBeside(Left(), residuals).likelihood - TorquesBeside(table, residuals).likelihood;
  return numbers;
}

const ColumnTable& Evidence::Left() {
  if (left_of_ != found_.chosen) left_ = MakeColumns(bench_, *found_.chosen, {}, torques_);
  left_of_ = found_.chosen;
  return left_;
}

}  // namespace gapscope
