// From what the search found to a verdict with a probability.
#ifndef GAPSCOPE_DIAGNOSE_VERDICT_H_
#define GAPSCOPE_DIAGNOSE_VERDICT_H_

#include "src/diagnose/diagnosis.h"
#include "src/diagnose/search.h"

namespace gapscope {

struct Judgement {
  Verdict verdict = Verdict::kNone;
  double probability = 0;                      // of the verdict as a whole
  std::vector<std::vector<EffectUse>> groups;  // ambiguous: one of the chosen effects and what could stand in its place
  std::vector<const Candidate*> explanations;  // the base and the single effects ...
  std::vector<double> probabilities;           // ... and the probability of each, adding up to one
  VerdictEvidence evidence;
};

Judgement Judge(const SearchResult& found);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_VERDICT_H_
