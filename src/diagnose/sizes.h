// Sizes of a finished set's effects, with what is known of them.
#ifndef GAPSCOPE_DIAGNOSE_SIZES_H_
#define GAPSCOPE_DIAGNOSE_SIZES_H_

#include <map>

#include "src/diagnose/candidate.h"
#include "src/diagnose/diagnosis.h"

namespace gapscope {

// `beside`: covariance that random torques add (BesideTorques::widening). `left_out`: LeftOut::values; an interval is
// as wide as the wider of what the residuals' slopes and what leaving logs out say. A size that is known much better as
// a ratio to a base parameter than alone has that too: a factor common to all torques and masses stays open from motion
// alone.
std::map<EffectUse, std::vector<EffectEstimate>> EstimateSizes(const Workbench& bench, const Candidate& candidate,
                                                               const Eigen::MatrixXd& beside,
                                                               const std::vector<std::vector<double>>& left_out);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_SIZES_H_
