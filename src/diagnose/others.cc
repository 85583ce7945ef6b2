#include "src/diagnose/others.h"

#include <algorithm>
#include <cmath>

#include "src/diagnose/exchange.h"
#include "src/diagnose/policy.h"

namespace gapscope {
namespace {

// Whether the search ended before a fit of the use that its columns promise something of, beside the set's trials.
bool WasNotReached(const SearchResult& found, const EffectUse& use, std::vector<std::size_t> set) {
  const ColumnTable& table = found.columns;
  const auto fitted = [&](const Candidate* candidate) { return Has(candidate->effects, use); };
  if (found.cut.empty() || std::ranges::any_of(found.ledger.All(), fitted)) return false;
  const std::size_t t = BestTrial(table, use, set);
  if (t == table.trials.size()) return false;
  const double without = SetCost(table, set);
  set.push_back(t);
  return std::log(without / SetCost(table, set)) >= kDiagnosePolicy.search.promise;
}

}  // namespace

void TellOthers(const Workbench& bench, const SearchResult& found, Judgement* result) {
  const ColumnTable& table = found.columns;
  if (!table.valid) return;  // nothing was looked at
  const std::vector<std::size_t> set = TrialsOf(found, found.chosen->effects);
  for (const EffectUse& use : found.uses) {
    if (result->Find(use)) continue;
    if (WasNotReached(found, use, set)) {
      result->statements.push_back(
          {.use = use, .answer = Answer::kUnseen, .prior = bench.PriorOf(use), .rule = kNotTried});
      continue;
    }
    bool tried = false;
    double seen = 0, moved = 0;
    for (std::size_t t = 0; t < table.trials.size(); ++t) {
      if (table.trials[t].use != use) continue;
      tried = true;
      const Eigen::Index c = table.trials[t].columns.front();
      moved = std::max(moved, table.sum(c, c));
      if (table.sum(c, c) > 0)
        seen = std::max(seen, table.reduced(table.Reduced(c), table.Reduced(c)) / table.sum(c, c));
    }
    constexpr double kNothing = 1e-3;  // of a column is left beside the base model's parameters
    Statement statement{
        .use = use, .answer = seen > kNothing ? Answer::kAbsent : Answer::kUnseen, .prior = bench.PriorOf(use)};
    statement.rule = seen > kNothing ? "gains too little beside the effects of the final set"
                     : moved > 0     ? "the base model's parameters imitate it fully"
                     : tried         ? "these logs do not move what it acts on"
                                     : kNotSimulated;
    result->statements.push_back(std::move(statement));
  }
  for (const EffectUse& use : found.out_of_sight)
    result->statements.push_back(
        {.use = use, .answer = Answer::kUnseen, .prior = bench.PriorOf(use), .rule = kOutOfSight});
}

}  // namespace gapscope
