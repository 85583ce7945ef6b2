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
// The same of a table, with `columns` taken out too. `residuals`: numbers of the logs.
TorquePrior TorquesBeside(const ColumnTable& table, std::span<const Eigen::Index> columns, std::size_t residuals);

// Of random sums of torques in the residual's place: the share of which one of the trials holds at least `held` (of the
// sum's square), with its own sign.
double Mimicry(const ColumnTable& table, const std::vector<RandomTorque>& torques, double held);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_DISCREPANCY_H_
