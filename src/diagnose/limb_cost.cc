#include "src/diagnose/limb_cost.h"

#include <algorithm>
#include <cmath>

namespace gapscope {

std::vector<LimbCost> CostsByLimb(const FitProblem& problem, const Residuals& residuals, const Coupling& coupling) {
  std::vector<LimbCost> limbs(coupling.limb_count());
  if (limbs.size() == 1) limbs.front().noise = 0.5 * static_cast<double>(problem.residuals());
  for (std::size_t w = 0; w < problem.windows().size(); ++w) {
    if (residuals[w].size() == 0) continue;
    const FitWindow& window = problem.windows()[w];
    const auto& measured = problem.recordings()[window.log].measured;
    for (std::size_t s = 0; s < measured.size(); ++s) {
      const Eigen::VectorXd own = residuals[w].segment(static_cast<Eigen::Index>(s) * window.scored(), window.scored());
      LimbCost& limb = limbs[coupling.LimbOf(measured[s].index)];
      limb.cost += 0.5 * problem.huber().Sum(own);
      if (limbs.size() > 1) limb.noise += 0.5 * static_cast<double>((own.array() != 0).count());
    }
  }
  return limbs;
}

std::vector<LimbCost> ScaledTo(double cost, std::vector<LimbCost> limbs) {
  double all = 0;
  for (const LimbCost& limb : limbs) all += limb.cost;
  for (LimbCost& limb : limbs) limb.cost = all > 0 ? cost * limb.cost / all : cost / static_cast<double>(limbs.size());
  return limbs;
}

double LogCost(std::span<const LimbCost> limbs) {
  double sum = 0;
  for (const LimbCost& limb : limbs) sum += std::log(limb.cost);
  return sum;
}

double LogCostAboveNoise(std::span<const LimbCost> limbs) {
  double sum = 0;
  for (const LimbCost& limb : limbs) sum += std::log(std::max(limb.cost, limb.noise));
  return sum;
}

}  // namespace gapscope
