#include "src/diagnose/probability.h"

#include <algorithm>
#include <cmath>

#include "src/core/statistics.h"
#include "src/diagnose/policy.h"

namespace gapscope {

namespace {

// On what was not fitted; minus infinity: it tells nothing.
double UnseenGain(const StatementNumbers& n) {
  double gain = -kInfinity;
  for (const double one : {n.gain_held_out, n.gain_free}) {
    if (std::isfinite(one)) gain = std::max(gain, one);
  }
  return gain;
}

}  // namespace

bool IsUnconfirmed(const StatementNumbers& n) {
  const double unseen = UnseenGain(n);
  return std::isfinite(unseen) && unseen < kDiagnosePolicy.search.member;
}

double LargestGain(const StatementNumbers& n) {
  const double unseen = UnseenGain(n);
  return IsUnconfirmed(n) || !std::isfinite(n.gain) ? unseen : std::max(n.gain, unseen);
}

std::vector<EvidenceTerm> EvidenceTermsOf(const StatementNumbers& n) {
  const ProbabilityPolicy& w = kDiagnosePolicy.probability;
  const double gain = LargestGain(n);
  const double evidence = std::copysign(std::log1p(std::abs(n.discrepancy)), n.discrepancy);
  return {
      {"constant", 1, 1, w.constant},
      {"largest gain", gain, std::clamp(gain, -1.0, kDiagnosePolicy.evidence.most_gain), w.gain},
      {"discrepancy evidence", n.discrepancy, std::clamp(evidence, -1.0, w.most_discrepancy), w.discrepancy},
      {"clear of chance", n.clear, std::clamp(n.clear, w.least_clear, w.most_clear), w.clear},
      {"looks like roughness", n.smooth ? 1.0 : 0.0, n.smooth ? 1.0 : 0.0, w.smooth},
      {"dry friction", n.dry ? 1.0 : 0.0, n.dry ? 1.0 : 0.0, w.dry},
  };
}

double ProbabilityOf(const StatementNumbers& numbers) {
  double x = 0;
  for (const EvidenceTerm& term : EvidenceTermsOf(numbers)) x += term.Adds();
  return 1 / (1 + std::exp(-x));
}

double AtPrior(double evidence, double prior) {
  const double yes = evidence * prior, no = (1 - evidence) * (1 - prior);
  return yes + no > 0 ? yes / (yes + no) : prior;
}

}  // namespace gapscope
