#include "src/compare/torque_curve.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

constexpr double kCurveFriction_n_m = 0.002;

// Torques that the Qube lacks with so much friction on its arm, along a log of a Qube that has kCurveFriction_n_m.
class TorqueCurveTest : public ::testing::Test {
 protected:
  std::vector<ResidualTorque> Missing(double friction_n_m) const {
    const auto model = MakeModel(experiment_, {{"coulomb_friction", "arm"}});
    Recording log =
        MakeRecording(experiment_, 4000, 0.002, [](int, double t) { return 3 * std::sin(4 * t) + std::sin(1.3 * t); });
    log.timeline.median_step_s = 0.002;
    const auto predicted = Predict(*model, log, {{"coulomb_friction@arm.friction_n_m", kCurveFriction_n_m}});
    for (std::size_t s = 0; s < predicted.size(); ++s) log.measured[s].values = predicted[s];
    return EstimateResidualTorque(*model, ValuesWith(*model, {{"coulomb_friction@arm.friction_n_m", friction_n_m}}),
                                  log);
  }
  const Experiment experiment_ = ShippedExperiment("qube");
};

TEST_F(TorqueCurveTest, TheEffectThatIsThereLiesOnWhatIsMissing) {
  const auto curve = CompareTorques(Missing(0), Missing(kCurveFriction_n_m), 12);
  ASSERT_TRUE(curve);
  const TorqueCurve& speed = *curve;
  EXPECT_EQ(speed.joint, "arm");
  EXPECT_EQ(speed.over, TorqueCurve::Over::kSpeed);
  ASSERT_EQ(speed.at.size(), 12u);
  // Against the motion, at the outermost bins.
  EXPECT_NEAR(speed.effect_n_m.front(), kCurveFriction_n_m, 0.05 * kCurveFriction_n_m);
  EXPECT_NEAR(speed.effect_n_m.back(), -kCurveFriction_n_m, 0.05 * kCurveFriction_n_m);
  EXPECT_NEAR(speed.missing_n_m.front(), kCurveFriction_n_m, 0.1 * kCurveFriction_n_m);
  EXPECT_NEAR(speed.missing_n_m.back(), -kCurveFriction_n_m, 0.1 * kCurveFriction_n_m);
  for (std::size_t i = 1; i < speed.at.size(); ++i) EXPECT_GT(speed.at[i], speed.at[i - 1]);
}

TEST_F(TorqueCurveTest, OneOfHalfTheSizeFallsShort) {
  const auto curve = CompareTorques(Missing(0), Missing(kCurveFriction_n_m / 2), 12);
  ASSERT_TRUE(curve);
  EXPECT_NEAR(curve->effect_n_m.back(), -kCurveFriction_n_m / 2, 0.05 * kCurveFriction_n_m);
  EXPECT_NEAR(curve->missing_n_m.back(), -kCurveFriction_n_m, 0.1 * kCurveFriction_n_m);
}

TEST_F(TorqueCurveTest, WhatAddsNoTorqueHasNoCurve) { EXPECT_FALSE(CompareTorques(Missing(0), Missing(0), 12)); }

}  // namespace
}  // namespace gapscope::testing
