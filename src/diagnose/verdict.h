// From what the search found to a verdict with a probability.
#ifndef GAPSCOPE_DIAGNOSE_VERDICT_H_
#define GAPSCOPE_DIAGNOSE_VERDICT_H_

#include "src/diagnose/diagnosis.h"
#include "src/diagnose/search.h"

namespace gapscope {

struct Judgement {
  Verdict verdict = Verdict::kNone;
  double probability = 0;                      // of the verdict as a whole
  std::vector<const Candidate*> rivals;        // of the last effect of the chosen one, when ambiguous
  std::vector<const Candidate*> first_rivals;  // likewise of a pair's first effect
  std::vector<const Candidate*> explanations;  // the base and the single effects ...
  std::vector<double> probabilities;           // ... and the probability of each, adding up to one
  VerdictEvidence evidence;
};

Judgement Judge(const SearchResult& found);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_VERDICT_H_
