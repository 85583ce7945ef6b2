#include "src/compare/residual_torque.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

constexpr double kFriction_n_m = 0.002;

// The Qube with dry friction on the arm, replayed as if it were a log.
Recording WithFriction(const Experiment& experiment) {
  const auto model = MakeModel(experiment, {{"coulomb_friction", "arm"}});
  Recording recording =
      MakeRecording(experiment, 4000, 0.002, [](int, double t) { return 3 * std::sin(4 * t) + std::sin(1.3 * t); });
  recording.timeline.median_step_s = 0.002;
  const auto predicted = Predict(*model, recording, {{"coulomb_friction@arm.friction_n_m", kFriction_n_m}});
  for (std::size_t s = 0; s < predicted.size(); ++s) recording.measured[s].values = predicted[s];
  return recording;
}

TEST(ResidualTorqueTest, IsTheFrictionThatTheModelLacks) {
  const Experiment experiment = ShippedExperiment("qube");
  const auto model = MakeModel(experiment);
  const auto residuals = EstimateResidualTorque(*model, model->Nominal(), WithFriction(experiment));
  ASSERT_EQ(residuals.size(), 2u);
  EXPECT_EQ(residuals[0].joint, "arm");
  double along = 0, pendulum = 0;
  int rows = 0;
  for (std::size_t r = 0; r < residuals[0].torque_n_m.size(); ++r) {
    const double speed = residuals[0].speed_rad_per_s[r];
    pendulum = std::max(pendulum, std::abs(residuals[1].torque_n_m[r]));
    if (std::abs(speed) < 1) continue;  // local fits round the jump at reversal off
    along += residuals[0].torque_n_m[r] * (speed > 0 ? -1 : 1);
    ++rows;
  }
  ASSERT_GT(rows, 500);
  EXPECT_NEAR(along / rows, kFriction_n_m, 0.1 * kFriction_n_m);
  // Mapped: one sign above standstill, the other below.
  const TorqueMap map = MapTorque(residuals[0], 6, 4);
  for (std::size_t x = 0; x < 6; ++x) {
    // The outermost rows of the map: fast and negative, fast and positive.
    if (map.rows[x] > 20) {
      EXPECT_GT(map.mean_n_m[x], 0) << x;
    }
    if (map.rows[18 + x] > 20) {
      EXPECT_LT(map.mean_n_m[18 + x], 0) << x;
    }
  }
}

TEST(ResidualTorqueTest, NothingIsMissingFromTheModelItself) {
  const Experiment experiment = ShippedExperiment("qube");
  const auto model = MakeModel(experiment, {{"coulomb_friction", "arm"}});
  std::vector<double> values = ValuesWith(*model, {{"coulomb_friction@arm.friction_n_m", kFriction_n_m}});
  const auto own = EstimateResidualTorque(*model, values, WithFriction(experiment));
  ASSERT_EQ(own.size(), 2u);
  double sum = 0;
  int rows = 0;
  for (std::size_t r = 0; r < own[0].torque_n_m.size(); ++r) {
    if (std::abs(own[0].speed_rad_per_s[r]) < 1) continue;
    sum += own[0].torque_n_m[r] * (own[0].speed_rad_per_s[r] > 0 ? -1 : 1);
    ++rows;
  }
  EXPECT_NEAR(sum / rows, 0, 0.1 * kFriction_n_m);
}

double RmsOfArm(const Model& model, const std::vector<double>& values, const Recording& recording) {
  const auto residuals = EstimateResidualTorque(model, values, recording);
  double sum = 0;
  for (const double torque : residuals.at(0).torque_n_m) sum += torque * torque;
  return std::sqrt(sum / static_cast<double>(residuals.at(0).torque_n_m.size()));
}

// At 5 to 8 Hz a drive that is late, slow or measured late pushes at the wrong time, and friction by the load needs the
// drive's torque. With what is known of that in the model, little is missing: nothing, but where friction jumps at a
// reversal, which local fits round off.
TEST(ResidualTorqueTest, WhatDrivesAndSensorsRememberIsTakenFromTheLog) {
  const Experiment experiment = ShippedExperiment("qube");
  const auto bare = MakeModel(experiment);
  const struct {
    EffectUse use;
    std::string parameter;
    double value, left;
  } effects[] = {{{"command_delay", "motor"}, "delay_s", 0.02, 0.1},
                 {{"actuator_lag", "motor"}, "time_constant_s", 0.02, 0.1},
                 {{"sensor_delay", "all"}, "delay_s", 0.02, 0.1},
                 {{"load_friction", "arm"}, "coefficient", 0.3, 0.35}};
  for (const auto& [use, parameter, value, left] : effects) {
    const std::map<std::string, double> made = {{use.Text() + "." + parameter, value}};
    const auto model = MakeModel(experiment, {use});
    Recording log = MakeRecording(experiment, 3000, 0.002,
                                  [](int, double t) { return 2 * std::sin(32 * t) + 2 * std::sin(50 * t); });
    log.timeline.median_step_s = 0.002;
    const auto predicted = Predict(*model, log, made);
    for (std::size_t s = 0; s < predicted.size(); ++s) log.measured[s].values = predicted[s];
    EXPECT_LT(RmsOfArm(*model, ValuesWith(*model, made), log), left * RmsOfArm(*bare, bare->Nominal(), log))
        << use.effect;
  }
}

TEST(ResidualTorqueTest, UnknownMotionGivesNone) {
  const Experiment experiment = ShippedExperiment("qube");
  const auto model = MakeModel(experiment);
  Recording recording = WithFriction(experiment);
  recording.measured.pop_back();
  EXPECT_TRUE(EstimateResidualTorque(*model, model->Nominal(), recording).empty());
}

}  // namespace
}  // namespace gapscope::testing
