// Costs of a mechanism of several limbs, which no joint connects (Coupling::LimbOf).
//
// What is wrong with one limb must not count for less because the robot has others: each limb's squares have a variance
// of their own, so that the likelihood at its best variances is sum of n/2 ln(cost) over limbs. Of one limb that is the
// cost's own logarithm.
#ifndef GAPSCOPE_DIAGNOSE_LIMB_COST_H_
#define GAPSCOPE_DIAGNOSE_LIMB_COST_H_

#include <span>
#include <vector>

#include "src/fit/coupling.h"

namespace gapscope {

struct LimbCost {
  double cost = 0;
  double noise = 0;  // what the sensors' noise alone costs
};

// The cost of a point, without priors, by limbs; one where nothing is known of them.
std::vector<LimbCost> CostsByLimb(const FitProblem& problem, const Residuals& residuals, const Coupling& coupling);
// The same in proportion, so that they add up to `cost`.
std::vector<LimbCost> ScaledTo(double cost, std::vector<LimbCost> limbs);

double LogCost(std::span<const LimbCost> limbs);
// None below its noise: what lies under that says nothing.
double LogCostAboveNoise(std::span<const LimbCost> limbs);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_LIMB_COST_H_
