// What a finished set of effects is worth beside random smooth torques: how much wider its intervals are, below which
// size the effects that it lacks stay, and what a free-form torque would still explain.
#ifndef GAPSCOPE_DIAGNOSE_BESIDE_H_
#define GAPSCOPE_DIAGNOSE_BESIDE_H_

#include <map>
#include <vector>

#include "src/diagnose/columns.h"
#include "src/diagnose/diagnosis.h"

namespace gapscope {

struct BesideTorques {
  // Covariance that the torques add to the final set's y: its posterior beside them, of their likeliest size, less the
  // one without them, and by how far the optimum moves (Kennedy and O'Hagan 2001).
  Eigen::MatrixXd widening;
  // Of effects that the set lacks: sizes that they stay below.
  std::map<EffectUse, std::vector<EffectEstimate>> bounds;
  // Share of the final misfit that torques of angle, speed and command take away in blocks that they were not fitted
  // to.
  double free_form = 0;
};

// `final`: a fitted set. `uses`: of which bounds are wanted.
BesideTorques LookBeside(const Workbench& bench, Candidate& final, const std::vector<EffectUse>& uses);

// An effect and one that contains it and would take its place.
struct Beyond {
  EffectUse simpler, richer;
};
// Of those whose simpler effect is in the fitted set `at`: those of which a usual shape of the richer one would not
// show in the logs. Any other is excluded beside the torques (EvidencePolicy::bound_deviations), or nothing is known of
// its shapes.
std::vector<Beyond> NotExcluded(const Workbench& bench, Candidate& at, const std::vector<Beyond>& asked);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_BESIDE_H_
