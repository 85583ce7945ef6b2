// The score test of every effect at a fitted candidate: one replay per trial value instead of a refit.
#ifndef GAPSCOPE_DIAGNOSE_SCREEN_H_
#define GAPSCOPE_DIAGNOSE_SCREEN_H_

#include "src/diagnose/candidate.h"

namespace gapscope {

struct Screened {
  EffectUse use;
  double drop = 0;       // of the training cost, as a share
  double absorbed = 1;   // of the best trial
  bool visible = false;  // some trial leaves a trace that the parent cannot imitate
  std::vector<double> values;   // of the child's parameters: where its fit starts
  Eigen::VectorXd dy;           // the parent's answer
  Candidate child;              // model and problem, not fitted
};

// Every effect of `uses` on top of `parent`, best first. Effects that do not go together with the parent's are left out.
std::vector<Screened> Screen(const Workbench& bench, Candidate& parent, const std::vector<EffectUse>& uses);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_SCREEN_H_
