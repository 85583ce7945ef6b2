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

// Three carts apart, each pushed by the same force. `speed`: the experiment has that of b, which is not scored;
// `logged`: the log has it too.
struct Carts {
  Rig rig;
  std::vector<Recording> logs;
  ThreadPool pool{1};
  FitProblem problem;
  Residuals residuals;
  explicit Carts(bool speed, bool logged = false)
      : rig(LoadThreeCarts(false, speed)),
        logs(Logs(logged)),
        problem(*rig.model, logs, {.free = rig.model->FreeParameters(), .time_step_s = kCartStep_s},
                rig.model->Nominal(), pool),
        residuals(problem.Evaluate(problem.Start(), Keep::kResiduals).residuals) {}

  std::vector<Recording> Logs(bool speed) const {
    Recording log = MakeLog(rig, rig.model->Nominal(), [](double) { return 1.0; }, 1, kCartStep_s, 1e-3, 1);
    if (speed)
      log.measured.push_back({.spec = rig.experiment.measured[3],
                              .index = 3,
                              .column = "vb",
                              .values = std::vector<double>(log.rows(), 0.0)});
    return {log};
  }
  std::vector<LimbCost> Limbs() {
    std::vector<ProbeTorque> torques;
    for (int joint = 0; joint < 3; ++joint) torques.push_back({.joint = joint, .amplitude_n_m = 0.1, .phase_rad = 1});
    Work work;
    return CostsByLimb(problem, residuals, Coupling::Measure(problem, problem.Start(), torques, &work));
  }
};

// A speed that is not scored, or that no log has, has no residuals: as a limb it would cost nothing at all.
TEST(LimbCostTest, WhatIsNotScoredIsNoLimb) {
  for (const bool logged : {false, true}) {
    Carts carts(true, logged);
    const auto limbs = carts.Limbs();
    ASSERT_EQ(limbs.size(), 3U) << logged;
    for (const LimbCost& limb : limbs) EXPECT_GT(limb.noise, 0) << logged;
  }
}

TEST(LimbCostTest, CartsApartCostTheirOwnSignalsSquares) {
  Carts carts(false);
  const Residuals& residuals = carts.residuals;
  const auto limbs = carts.Limbs();
  ASSERT_EQ(limbs.size(), 3U);
  for (std::size_t limb = 0; limb < 3; ++limb) {
    double squares = 0;
    std::size_t count = 0;
    for (std::size_t w = 0; w < residuals.size(); ++w) {
      const Eigen::Index scored = carts.problem.windows()[w].scored();
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
