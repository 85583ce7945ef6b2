#include "src/diagnose/exchange.h"

#include <algorithm>

#include "src/core/collect.h"
#include "src/core/statistics.h"
#include "src/diagnose/beside.h"
#include "src/diagnose/policy.h"

namespace gapscope {
namespace {

// The trials of the chosen set with `use` in the place of `members`, that of `use` last; empty: it has no column.
std::vector<std::size_t> TrialsInPlace(const SearchResult& found, const EffectSet& members, const EffectUse& use) {
  std::vector<std::size_t> trials = TrialsOf(found, Without(found.chosen->effects, members));
  const std::size_t of_use = BestTrial(found.columns, use, trials);
  if (of_use == found.columns.trials.size()) return {};
  trials.push_back(of_use);
  return trials;
}

// Values in the order of PlacedParameters, by their names.
void SetValues(const Workbench& bench, const EffectUse& use, const std::vector<double>& at,
               std::map<std::string, double>* values) {
  const auto placed = PlacedParameters(use, *bench.rig, bench.scales);
  for (std::size_t i = 0; i < placed.size(); ++i) (*values)[placed[i].name] = at[i];
}

}  // namespace

void SetValues(const Workbench& bench, const Trial& trial, const BoundedSolution& solution,
               std::map<std::string, double>* values) {
  const auto at = ValuesAt(bench, trial, Collect(trial.columns, [&](Eigen::Index c) { return solution.values[c]; }));
  SetValues(bench, trial.use, at, values);
}

std::vector<std::vector<double>> UsualBeyond(const Workbench& bench, const Candidate& at, const EffectUse& simpler,
                                             const EffectUse& richer) {
  std::vector<std::vector<double>> all;
  const StartsFrom& from = EffectOf(richer, *bench.rig).starts_from;
  if (from.effect != simpler.effect || richer.on != simpler.on || !Has(at.effects, simpler)) return all;
  const std::string name = PlacedParameters(simpler, *bench.rig, bench.scales).front().name;
  const double size = at.values[static_cast<std::size_t>(at.model->IndexOf(name))];
  const auto placed = PlacedParameters(richer, *bench.rig, bench.scales);
  for (const auto& start : from.starts) {
    auto& values = all.emplace_back();
    for (std::size_t i = 0; i < placed.size(); ++i) {
      const double value = start[i].of_simpler * size + start[i].value;
      values.push_back(value == 0 ? placed[i].start : std::clamp(value, placed[i].low, placed[i].high));
    }
  }
  return all;
}

namespace {

// The set from where `at` stands, with the richer effect as it usually is beyond the simpler one.
void RefitBeyond(const Workbench& bench, Ledger& ledger, const EffectSet& set, const Candidate& at,
                 const Beyond& beyond, Effort effort) {
  for (const auto& start : UsualBeyond(bench, at, beyond.simpler, beyond.richer)) {
    std::map<std::string, double> values;
    SetValues(bench, beyond.richer, start, &values);
    ledger.Refit(set, at, values, {}, effort);
  }
}

}  // namespace

std::vector<std::size_t> TrialsOf(const SearchResult& found, const EffectSet& set) {
  const ColumnTable& table = found.columns;
  std::vector<std::size_t> trials;
  for (const EffectUse& use : set) {
    if (const std::size_t t = BestTrial(table, use, trials); t < table.trials.size()) trials.push_back(t);
  }
  return trials;
}

Candidate* RefitInPlace(const Workbench& bench, SearchResult& found, const EffectSet& members, const EffectUse& use,
                        Effort effort) {
  const ColumnTable& table = found.columns;
  const auto trials = TrialsInPlace(found, members, use);
  if (trials.empty()) return nullptr;
  std::map<std::string, double> values;
  SetValues(bench, table.trials[trials.back()], SolveSet(table, trials), &values);
  const EffectSet set = With(Without(found.chosen->effects, members), use);
  found.ledger.Refit(set, *found.chosen, values, {}, effort);
  for (const EffectUse& member : members) RefitBeyond(bench, found.ledger, set, *found.chosen, {member, use}, effort);
  return found.ledger.Find(set);
}

Candidate* RefitMerged(const Workbench& bench, SearchResult& found, const EffectUse& simpler, const EffectUse& richer) {
  const EffectSet set = Without(found.chosen->effects, simpler);
  found.ledger.Refit(set, *found.chosen, {}, {}, Effort::kTry);
  const Candidate* alone =
      found.ledger.Refit(Without(found.chosen->effects, richer), *found.chosen, {}, {}, Effort::kTry);
  if (alone) RefitBeyond(bench, found.ledger, set, *alone, {simpler, richer}, Effort::kTry);
  Candidate* merged = found.ledger.Find(set);
  if (merged) found.ledger.Continue(merged, Effort::kFinish);
  return merged;
}

double TieOf(double gain) { return std::max(kDiagnosePolicy.search.tie, kDiagnosePolicy.search.tie_share * gain); }

}  // namespace gapscope
