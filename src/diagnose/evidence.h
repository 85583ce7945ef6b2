// How much better one candidate explains the logs than another, block of time by block of time.
#ifndef GAPSCOPE_DIAGNOSE_EVIDENCE_H_
#define GAPSCOPE_DIAGNOSE_EVIDENCE_H_

#include "src/diagnose/candidate.h"

namespace gapscope {

struct Evidence {
  double gain = 0;      // held-out cost of a less that of b
  double held_out = 0;  // the same as a share of a's
  double train = 0;     // likewise on the training logs
  // Sum over all blocks, training and held out, of log((cost of a + floor) / (cost of b + floor)), and over its
  // standard error. Ratios, so that a few blocks with a large misfit that both share do not drown what happens in all
  // the others.
  double log_ratio = 0, z = 0;
};
// How `b` compares with `a`. An effect that cannot be simulated somewhere loses.
Evidence Compare(const Candidate& a, const Candidate& b);

// What a candidate leaves in the median half second of the held-out logs, over the noise: unlike
// Candidate::held_out_floors it does not see the few blocks where a step's edge is a sample off.
double TypicalFloors(const Candidate& candidate);

// Sum over all blocks of log(cost + floor): what orders candidates. Infinity for one that cannot be simulated
// somewhere.
double LogMisfit(const Candidate& candidate);

// What makes a gain convincing: a share of the held-out cost, some of the training cost, and more than chance; or so
// large a share of both that few blocks are enough.
struct Limits {
  double share = 0.01, z = 2.5;
};
bool Convincing(const Evidence& evidence, const Limits& limits);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_EVIDENCE_H_
