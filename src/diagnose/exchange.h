// One effect of a set in another one's place.
#ifndef GAPSCOPE_DIAGNOSE_EXCHANGE_H_
#define GAPSCOPE_DIAGNOSE_EXCHANGE_H_

#include <map>
#include <string>
#include <vector>

#include "src/diagnose/search.h"

namespace gapscope {

// Values of a trial's effect at its columns' coefficients, by the names of its parameters.
void SetValues(const Workbench& bench, const Trial& trial, const BoundedSolution& solution,
               std::map<std::string, double>* values);

// What `richer` usually is where `simpler`, of the fitted set `at`, is all that was looked for: values of its
// parameters (in the order of PlacedParameters), one list a shape (Effect::starts_from). Empty: nothing is known.
std::vector<std::vector<double>> UsualBeyond(const Workbench& bench, const Candidate& at, const EffectUse& simpler,
                                             const EffectUse& richer);

// Trials that stand for a set, at the base: of each effect the one that costs least beside those before.
std::vector<std::size_t> TrialsOf(const SearchResult& found, const EffectSet& set);

// The chosen set with `use` in the place of `members`, begun from the chosen set's optimum: a set that starts elsewhere
// and is not at its end looks exactly like a worse one. `use` starts at the trial that does best beside the other
// members, by arithmetic at the base, and at what it usually is beyond a member. Null: it has no column there, or the
// set cannot be built or simulated.
Candidate* RefitInPlace(const Workbench& bench, SearchResult& found, const EffectSet& members, const EffectUse& use,
                        Effort effort);

// The chosen set without `simpler`, begun where `richer` does that one's part too. Null: it cannot be simulated.
Candidate* RefitMerged(const Workbench& bench, SearchResult& found, const EffectUse& simpler, const EffectUse& richer);

// By how much more a set may cost with a rival in the place of a member that gains so much: up to it they tie.
double TieOf(double gain);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_EXCHANGE_H_
