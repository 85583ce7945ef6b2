// From what the search found to statements with probabilities, and the verdict that follows from them.
#ifndef GAPSCOPE_DIAGNOSE_JUDGE_H_
#define GAPSCOPE_DIAGNOSE_JUDGE_H_

#include "src/diagnose/diagnosis.h"
#include "src/diagnose/search.h"

namespace gapscope {

// Whether two members that stand in for each other may be judged as one: both gain alike, or most of what they gain
// shows only where both are taken out (`together`). Else the stronger one would lend the weaker one its evidence.
bool AreOneFinding(double gain_a, double gain_b, double together);

// Whether two members are seen only beside each other: either one, where the other one is missing, gains at most half
// of what it gains beside it. Gains are ln(cost without / cost with); what distinct effects gain adds up in costs.
bool AreComplements(double gain_a, double gain_b, double together);
// On the logs that were fitted, or on those that were held out: there one alone may do harm.
bool AreComplements(const StatementNumbers& a, const StatementNumbers& b, const StatementNumbers& together);

// Of a set's members the one to take out first, the least likely of those that it can do without: what is not sure and
// hardly gains, or not on held-out logs, and what nothing unseen confirms. The end: there is none.
std::vector<Statement>::iterator LeastLikelySpare(std::vector<Statement>& members);

// Of an effect and a simpler one that it contains, by the probability of what it does beyond that one.
enum class Told { kSimpler, kTogether, kRicher };
Told ToldBeyond(double probability);

struct Judgement {
  std::vector<Statement> statements;           // the surest first; sizes are left to whoever describes them
  std::vector<std::vector<EffectUse>> groups;  // by Statement::group
  Verdict verdict = Verdict::kNone;
  double probability = 0;    // of the verdict as a whole
  VerdictEvidence evidence;  // of the refitted base model; what is left is the final set's

  // The first statement about a use; null: there is none.
  Statement* Find(const EffectUse& use);
};

Judgement Judge(const Workbench& bench, SearchResult& found, const Say& say);

// What a verdict is derived from.
struct VerdictFacts {
  bool present = false, told = true;  // an effect is there; none of them stands in a group
  double floors_left = 0;             // of the final model; of the base model where nothing is present
  double retuned = 0;                 // share of the nominal model's held-out cost that refitting took
};
Verdict VerdictOf(const VerdictFacts& facts);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_JUDGE_H_
