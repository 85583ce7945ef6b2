#include "src/diagnose/gap_shares.h"

#include <algorithm>
#include <cmath>

#include "src/core/statistics.h"
#include "src/diagnose/block_errors.h"
#include "src/diagnose/policy.h"

namespace gapscope {
namespace {

double Binomial(std::size_t n, std::size_t k) {
  double result = 1;
  for (std::size_t i = 1; i <= k; ++i) result *= static_cast<double>(n - k + i) / static_cast<double>(i);
  return result;
}

// How often each of `blocks` half seconds is in each draw; the first is the logs as they are.
std::vector<std::vector<double>> Draws(std::size_t blocks) {
  std::vector<std::vector<double>> draws = {std::vector<double>(blocks, 1)};
  std::mt19937_64 random(13);
  for (std::size_t d = 0; d < kDiagnosePolicy.evidence.draws; ++d) {
    draws.emplace_back(blocks, 0);
    for (std::size_t b = 0; b < blocks; ++b) draws.back()[random() % blocks] += 1;
  }
  return draws;
}

}  // namespace

GapShares::GapShares(const Workbench& bench, SearchResult& found, const Candidate& final,
                     const std::vector<std::vector<EffectUse>>& groups)
    : bench_(bench), found_(found), final_(final), draws_(Draws(NormalisedSquares(final.held_out).size())) {
  EffectSet left = final.effects;
  for (const auto& group : groups) {
    EffectSet player;
    for (const EffectUse& use : group) {
      if (std::erase(left, use) > 0) player = With(player, use);
    }
    if (!player.empty()) players_.push_back(player);
  }
  for (const EffectUse& use : left) players_.push_back({use});
}

const std::vector<double>& GapShares::Errors(const EffectSet& set) {
  const auto [place, fresh] = errors_.try_emplace(set, draws_.size(), kNaN);
  if (!fresh) return place->second;
  const Candidate* candidate = &final_;
  if (set != final_.effects) {
    Candidate* fitted = found_.ledger.FindOrTry(set, final_);
    if (!fitted) return place->second;
    ScoreCandidate(bench_, fitted);
    candidate = fitted;
  }
  const BlockSquares squares = NormalisedSquares(candidate->held_out);
  if (squares.size() != draws_.front().size()) return place->second;
  for (std::size_t d = 0; d < draws_.size(); ++d) {
    double sum = 0;
    std::size_t b = 0;
    for (const auto& [block, square] : squares) sum += draws_[d][b++] * square;
    place->second[d] = std::sqrt(sum);
  }
  return place->second;
}

ShareOfGap GapShares::Of(const EffectUse& use) {
  const auto own =
      std::find_if(players_.begin(), players_.end(), [&](const EffectSet& player) { return Has(player, use); });
  if (own == players_.end()) return {};
  std::vector<const EffectSet*> others;
  for (auto player = players_.begin(); player != players_.end(); ++player) {
    if (player != own) others.push_back(&*player);
  }
  const auto joined = [](EffectSet set, const EffectSet& more) {
    for (const EffectUse& each : more) set = With(set, each);
    return set;
  };
  constexpr std::size_t kMost = 3;
  std::vector<double> sums(draws_.size(), 0);
  double weight = 0;
  for (std::size_t bits = 0; bits < (std::size_t{1} << others.size()); ++bits) {
    EffectSet part;
    std::size_t members = 0;
    for (std::size_t i = 0; i < others.size(); ++i) {
      if (bits >> i & 1) part = joined(part, *others[i]), ++members;
    }
    const bool end = members == 0 || members == others.size();
    if (players_.size() > kMost && !end) continue;
    const auto &with = Errors(joined(part, *own)), &without = Errors(part);
    if (!std::isfinite(with[0]) || !std::isfinite(without[0])) continue;
    // Of n players: |S|! (n - |S| - 1)! / n!, up to a factor that all have in common.
    const double w = end ? 1 : 1 / Binomial(others.size(), members);
    for (std::size_t d = 0; d < sums.size(); ++d) sums[d] += w * (without[d] - with[d]);
    weight += w;
  }
  const auto &before = Errors({}), &after = Errors(final_.effects);
  std::vector<double> shares;
  for (std::size_t d = 0; d < sums.size(); ++d) {
    const double gap = before[d] - after[d];
    shares.push_back(weight > 0 && gap > 0 ? std::clamp(sums[d] / weight / gap, 0.0, 1.0) : 0);
  }
  const double value = shares.front();
  shares.erase(shares.begin());
  return {.value = value,
          .low = std::min(value, Quantile(shares, 0.025)),
          .high = std::max(value, Quantile(shares, 0.975))};
}

}  // namespace gapscope
