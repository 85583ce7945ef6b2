// From a statement's numbers to its probability: a logistic function of a sum of terms (ProbabilityPolicy).
#ifndef GAPSCOPE_DIAGNOSE_PROBABILITY_H_
#define GAPSCOPE_DIAGNOSE_PROBABILITY_H_

#include <string>
#include <vector>

#include "src/diagnose/diagnosis.h"

namespace gapscope {

// What one number adds to the logarithm of the odds.
struct EvidenceTerm {
  std::string name;               // in words
  double value = 0, counted = 0;  // the number; what of it counts: its logarithm, or cut off where it says nothing more
  double weight = 0;
  double Adds() const { return weight * counted; }
};
// Whether nothing that was not fitted shows it: what each effect of the set must gain, it gains on fitted logs alone.
bool IsUnconfirmed(const StatementNumbers& numbers);
// The largest of the three gains: an effect that is there shows most where its absence adds up. What is gained on
// fitted logs does not count where it is unconfirmed.
double LargestGain(const StatementNumbers& numbers);
// All terms, the constant first.
std::vector<EvidenceTerm> EvidenceTermsOf(const StatementNumbers& numbers);

// At even prior odds: 1 / (1 + exp(-sum of the terms)).
double ProbabilityOf(const StatementNumbers& numbers);

// The same evidence at other prior odds: Bayes' rule. Both 0 .. 1.
double AtPrior(double evidence, double prior);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_PROBABILITY_H_
