// The search for the effects that a model lacks: sets ordered by arithmetic on columns, the promising ones refitted,
// members taken out and exchanged from the leader's optimum.
#ifndef GAPSCOPE_DIAGNOSE_SEARCH_H_
#define GAPSCOPE_DIAGNOSE_SEARCH_H_

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "src/diagnose/columns.h"
#include "src/diagnose/diagnosis.h"
#include "src/diagnose/ledger.h"
#include "src/diagnose/rules.h"

namespace gapscope {

// What the search knows of an effect of the final set.
struct Member {
  EffectUse use;
  const Candidate* without = nullptr;  // the best set without it
  double gain = 0;                     // ln(cost without / cost of the set)
  std::vector<Rival> rivals;           // the nearest first
  bool asked = false;                  // whether all that could be in its place was tried
};

struct SearchResult {
  explicit SearchResult(const Workbench& bench) : ledger(bench) {}
  Ledger ledger;
  std::unique_ptr<Candidate> nominal;  // as given, unfitted
  Candidate* base = nullptr;           // refitted, without effects
  Candidate* chosen = nullptr;         // the final set; the base where nothing was found
  std::vector<Member> members;         // of it
  ColumnTable columns;                 // at the base
  std::vector<EffectUse> uses;         // all that were tried
  std::vector<EffectUse> out_of_sight;
  LoggedSignals logged;
  bool uneven = false;           // training and held-out logs show the gap very differently
  std::vector<std::string> cut;  // what the budget left out

  bool HasMember(const EffectUse& use) const { return std::ranges::find(members, use, &Member::use) != members.end(); }
};

// What `with` has and `without` lacks gains: ln(cost without / cost with), limb by limb.
double Gain(const Candidate& without, const Candidate& with);
// The same; what lies below the noise counts as the noise.
double GainAboveNoise(const Candidate& without, const Candidate& with);
// The cost above which a set is so far behind the chosen one that it matters little how far.
double FarBehind(const Candidate& chosen);

// A set of effects, and values of its parameters, that a search elsewhere ended at.
struct Hint {
  EffectSet effects;
  std::map<std::string, double> values;
};
// Finds effects from there on; each hint is one more set that may lead.
void FindEffects(const Workbench& bench, const std::vector<Hint>& hints, const Say& say, SearchResult* result);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_SEARCH_H_
