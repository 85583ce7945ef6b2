// What an effect explains beside random smooth torques, the alternative that every rig has (Kennedy and O'Hagan,
// J. R. Statist. Soc. B 63, 2001: a discrepancy is generated with, not fitted away).
#ifndef GAPSCOPE_DIAGNOSE_DISCREPANCY_H_
#define GAPSCOPE_DIAGNOSE_DISCREPANCY_H_

#include "src/diagnose/columns.h"

namespace gapscope {

// The likeliest size of random torques beside a fit, and what their columns then leave as noise. `numbers` of the
// residuals count, a share of all.
struct TorquePrior {
  double ratio = 0;     // variance of a torque's coefficient over that of the noise
  double variance = 1;  // of a number that counts
  double share = 1;
  double likelihood = 0;  // log, at these
};
// `m`: products of [torques | residual], all else taken out.
TorquePrior LikeliestTorques(const Eigen::MatrixXd& m, double numbers, double share);
// The same of a table. `residuals`: numbers of the logs.
TorquePrior TorquesBeside(const ColumnTable& table, std::size_t residuals);
// Log likelihood of a table of MakeByLimb, each limb with torques and noise of its own size.
double LikelihoodByLimb(const ColumnTable& table, std::size_t residuals);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_DISCREPANCY_H_
