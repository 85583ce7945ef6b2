#include "src/diagnose/evidence.h"

#include <algorithm>
#include <cmath>

#include "src/core/collect.h"
#include "src/core/statistics.h"
#include "src/diagnose/block_errors.h"
#include "src/diagnose/discrepancy.h"
#include "src/diagnose/policy.h"
#include "src/diagnose/torques.h"
#include "src/fit/policy.h"

namespace gapscope {
namespace {

// Of logarithms of costs.
double GainOf(double before, double after) {
  const double most = kDiagnosePolicy.evidence.most_gain;
  if (after == kInfinity) return before == kInfinity ? kNaN : -most;
  return before == kInfinity ? most : before - after;
}

// Errors of free runs as a gain.
double FreeGain(double before, double after) {
  return AreLost(before, after) ? kNaN : 2 * GainOf(std::log(before), std::log(std::max(after, 1e-300)));
}

// What each half second of the held-out logs gains.
BlockSquares GainsByBlock(const Workbench& bench, const Candidate& without, const Candidate& with) {
  const auto weight = [&](std::size_t log, std::size_t signal) {
    const double w = bench.weights[bench.data->held_out[log].measured[signal].index];
    return w * w;
  };
  BlockSquares gains = SquaresByBlock(without.held_out, weight);
  for (const auto& [block, square] : SquaresByBlock(with.held_out, weight)) gains[block] -= square;
  return gains;
}

// Their sum over its standard error: half seconds are independent.
double ClearBy(const BlockSquares& gains) {
  const auto values = Collect(gains, [](const auto& entry) { return entry.second; });
  const Moments moments = MomentsOf(values);
  return moments.deviation > 0 ? std::sqrt(static_cast<double>(values.size())) * moments.mean / moments.deviation : 0;
}

// The half seconds that gain most, and the one that gains least.
std::vector<BlockGain> Carriers(const Workbench& bench, const BlockSquares& gains) {
  constexpr std::size_t kMost = 12;
  double total = 0;
  for (const auto& [block, gain] : gains) total += gain;
  if (!(total > 0)) return {};
  std::vector<BlockGain> blocks;
  for (const auto& [block, gain] : gains) {
    const Recording& log = bench.data->held_out[block.first];
    const double from_s = log.start_s + static_cast<double>(block.second) * kFitPolicy.block_s;
    blocks.push_back(
        {.log = log.log_path, .from_s = from_s, .to_s = from_s + kFitPolicy.block_s, .share = gain / total});
  }
  std::stable_sort(blocks.begin(), blocks.end(), [](const auto& a, const auto& b) { return a.share > b.share; });
  if (blocks.size() > kMost) blocks.erase(blocks.begin() + (kMost - 1), blocks.end() - 1);
  return blocks;
}

}  // namespace

Evidence::Evidence(const Workbench& bench, SearchResult& found)
    : bench_(bench), found_(found), torques_(MakeTorques(bench)), free_left_(RunFree(bench, *found.chosen)) {
  ScoreCandidate(bench_, found_.chosen);
}

void Evidence::Choose(Candidate* candidate) {
  found_.ledger.Continue(candidate, Effort::kFinish);
  ScoreCandidate(bench_, candidate);
  found_.chosen = candidate;
  free_left_ = RunFree(bench_, *candidate);
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

void Evidence::Of(const std::vector<EffectUse>& uses, Statement* statement) {
  const EffectSet rest = Without(found_.chosen->effects, uses);
  Candidate* without = found_.ledger.Find(rest);
  if (!without || uses.size() > 1) without = found_.ledger.Refit(rest, *found_.chosen, {}, {}, Effort::kTry);
  Of(uses, without ? without : found_.base, statement);
}

void Evidence::Of(const std::vector<EffectUse>& uses, Candidate* without, Statement* statement) {
  Compare(without);
  ScoreCandidate(bench_, without);
  StatementNumbers& numbers = statement->numbers;
  const BlockSquares gains = GainsByBlock(bench_, *without, *found_.chosen);
  statement->sets = std::make_shared<const ComparedSets>(
      ComparedSets{.with = RunModelOf(*found_.chosen->model, found_.chosen->values),
                   .without = RunModelOf(*without->model, without->values),
                   .blocks = Carriers(bench_, gains)});
  numbers.gain = GainOf(LogCostAboveNoise(without->train_limbs), LogCostAboveNoise(found_.chosen->train_limbs));
  numbers.gain_held_out =
      GainOf(LogCostAboveNoise(without->held_out_limbs), LogCostAboveNoise(found_.chosen->held_out_limbs));
  numbers.gain_free = FreeGain(RunFree(bench_, *without).error, free_left_.error);
  numbers.clear = ClearBy(gains);
  SetCharacter(uses, &numbers);
  if (torques_.empty()) return;
  const ColumnTable table = MakeByLimb(bench_, *without, torques_);
  if (!table.valid || !Left().valid) return;
  const std::size_t residuals = without->problem->residuals();
  numbers.discrepancy = LikelihoodByLimb(Left(), residuals) - LikelihoodByLimb(table, residuals);
}

const ColumnTable& Evidence::Left() {
  if (left_of_ != found_.chosen) left_ = MakeByLimb(bench_, *found_.chosen, torques_);
  left_of_ = found_.chosen;
  return left_;
}

}  // namespace gapscope
