// Costs by limbs against sums made by hand.
#include "src/diagnose/limb_cost.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

TEST(LimbCostTest, OfOneLimbItIsTheCost) {
  EXPECT_DOUBLE_EQ(LogCost(std::vector<LimbCost>{{.cost = 7, .noise = 9}}), std::log(7.0));
  EXPECT_DOUBLE_EQ(LogCostAboveNoise(std::vector<LimbCost>{{.cost = 7, .noise = 9}}), std::log(9.0));
}

// Half of one limb's squares gone is as much as half of a lone limb's.
TEST(LimbCostTest, OtherLimbsTakeNothingFromAGain) {
  const std::vector<LimbCost> without = {{100, 1}, {1000, 1}, {10, 1}}, with = {{50, 1}, {1000, 1}, {10, 1}};
  EXPECT_NEAR(LogCost(without) - LogCost(with), std::log(2.0), 1e-12);
}

TEST(LimbCostTest, PartsAddUpToTheCost) {
  const auto scaled = ScaledTo(30, {{.cost = 4, .noise = 2}, {.cost = 6, .noise = 5}});
  EXPECT_DOUBLE_EQ(scaled[0].cost, 12);
  EXPECT_DOUBLE_EQ(scaled[1].cost, 18);
  EXPECT_DOUBLE_EQ(scaled[1].noise, 5);
}

TEST(LimbCostTest, CartsApartCostTheirOwnSignalsSquares) {
  const Rig rig = LoadThreeCarts(false);
  std::vector<Recording> logs = {
      MakeLog(rig, rig.model->Nominal(), [](double) { return 1.0; }, 1, kCartStep_s, 1e-3, 1)};
  ThreadPool pool(1);
  FitProblem problem(*rig.model, logs, {.free = rig.model->FreeParameters(), .time_step_s = kCartStep_s},
                     rig.model->Nominal(), pool);
  std::vector<ProbeTorque> torques;
  for (int joint = 0; joint < 3; ++joint) torques.push_back({.joint = joint, .amplitude_n_m = 0.1, .phase_rad = 1});
  Work work;
  const Coupling coupling = Coupling::Measure(problem, problem.Start(), torques, &work);
  Residuals residuals = problem.Evaluate(problem.Start(), Keep::kResiduals).residuals;
  const auto limbs = CostsByLimb(problem, residuals, coupling);
  ASSERT_EQ(limbs.size(), 3U);
  for (std::size_t limb = 0; limb < 3; ++limb) {
    double squares = 0;
    std::size_t count = 0;
    for (std::size_t w = 0; w < residuals.size(); ++w) {
      const Eigen::Index scored = problem.windows()[w].scored();
      for (Eigen::Index r = 0; r < scored; ++r) {
        const double value = residuals[w][static_cast<Eigen::Index>(limb) * scored + r];
        squares += value * value;
        count += value != 0;
      }
    }
    EXPECT_NEAR(limbs[limb].cost, 0.5 * squares, 1e-12 * squares);
    EXPECT_DOUBLE_EQ(limbs[limb].noise, 0.5 * static_cast<double>(count));
  }
}

}  // namespace
}  // namespace gapscope::testing
