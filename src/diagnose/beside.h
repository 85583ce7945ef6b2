// What a finished set of effects is worth beside random smooth torques: how much wider its intervals are, below which
// size the effects that it lacks stay, and what a free-form torque would still explain.
#ifndef GAPSCOPE_DIAGNOSE_BESIDE_H_
#define GAPSCOPE_DIAGNOSE_BESIDE_H_

#include <map>

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

// Whether the logs would show what `richer` usually is beyond `simpler` of the fitted set `at`, whose place it takes,
// and do not: each of its shapes is excluded beside the torques (EvidencePolicy::bound_deviations). True where nothing
// is known of its shapes.
bool IsExcludedBeyond(const Workbench& bench, Candidate& at, const EffectUse& simpler, const EffectUse& richer);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_BESIDE_H_
