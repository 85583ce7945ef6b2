// The candidates that an experiment file states, as effects beside the catalogue's. What the catalogue's files say of
// an effect is found from its expressions: which parameters are sizes, which act linearly, what it is a function of.
#ifndef GAPSCOPE_MODEL_OWN_CANDIDATES_H_
#define GAPSCOPE_MODEL_OWN_CANDIDATES_H_

#include <vector>

#include "src/model/effect.h"

namespace gapscope {

struct CandidateEffects {
  std::vector<Effect> effects;
  std::vector<LeftOutCandidate> left_out;
};

// Errors, with their place in the experiment file: a name that the catalogue has; a joint or a field that the MJCF
// lacks; a command of a joint without drive; a candidate that does something at its neutral values, or has no values to
// be tried at; a parameter that its plugin does not read.
Result<CandidateEffects> OwnCandidates(const Rig& rig);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_OWN_CANDIDATES_H_
