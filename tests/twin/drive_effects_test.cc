// Each effect of the drive shows its own signature.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/twin/effects.h"
#include "tests/twin/plants.h"

namespace gapscope::twin {
namespace {

// A command that jumps to `value` at 10 ms.
Commands Jump(double value, double late_s, double feedforward = 0) {
  Commands commands;
  commands.Add(0, 0, 0, 0);
  commands.Add(0.01, value, feedforward, late_s);
  return commands;
}

TEST(DriveEffectsTest, CommandDelayShiftsTheResponse) {
  Plant plant = NominalPlant(Rig::kFlexLink);
  Simulator prompt(plant, kStep_s), late(plant, kStep_s);
  RunFor(0.2, Jump(1, 0), &prompt);
  RunFor(0.2 + 0.007, Jump(1, 0.007), &late);
  EXPECT_NEAR(late.q1(), prompt.q1(), 1e-12);
}

TEST(DriveEffectsTest, TorqueDelayLeavesFirstMillisecondsUndamped) {
  // Until the delay has passed the servo sees its own past: no torque at all.
  Plant plant = NominalPlant(Rig::kJoint);
  plant.drive.torque_delay_s = 0.005;
  Simulator simulator(plant, kStep_s);
  RunFor(0.0149, Jump(0.1, 0), &simulator, [](const Simulator& s) { ASSERT_EQ(s.drive().torque_n_m, 0); });
  RunFor(0.001, Jump(0.1, 0), &simulator);
  EXPECT_NEAR(simulator.drive().torque_n_m, 15.71451, 1e-6);
}

TEST(DriveEffectsTest, TorqueDelayTakesPhaseFromTheLoop) {
  // Characteristic equation I s^2 + ((kd s + kp) e^(-s d)) + b s = 0 at the stability limit of a pure gain without kd:
  // with kd = b = 0 any delay makes the loop unstable; growth rate about w^2 d / 2.
  Plant plant = TorqueSource();
  plant.base.kp_n_m_per_rad = 157.1451;
  plant.drive.torque_delay_s = 0.002;
  Simulator simulator(plant, kStep_s);
  simulator.Place(0.01, 0, 0, 0);
  const double w = std::sqrt(157.1451 / 0.159221308);
  double peak = 0;
  RunFor(1.0, Constant(0), &simulator, [&](const Simulator& s) {
    if (s.time_s() > 1 - kTurn / w) peak = std::max(peak, std::abs(s.q1()));
  });
  EXPECT_NEAR(std::log(peak / 0.01), w * w * 0.002 / 2 * 0.95, 0.12);
}

TEST(DriveEffectsTest, LagOfCurrentDriveIsTwoPoles) {
  Plant plant = NominalPlant(Rig::kFlexLink);
  plant.drive.lag_s = 0.010;
  plant.drive.second_lag_s = 0.002;
  Simulator simulator(plant, kStep_s);
  RunFor(0.05, Constant(1), &simulator, [](const Simulator& s) {
    const double t = s.time_s();
    const double expected = 1 - (0.010 * std::exp(-t / 0.010) - 0.002 * std::exp(-t / 0.002)) / 0.008;
    ASSERT_NEAR(s.drive().current_a, expected, 1e-6);
  });
}

TEST(DriveEffectsTest, LagOfVoltageDriveHasBackEmfInside) {
  Plant plant = NominalPlant(Rig::kQube);
  plant.drive.lag_s = 0.02;
  plant.base.arm_mass_kg = 1e6;  // stalled
  Simulator simulator(plant, kStep_s);
  RunFor(0.02, Constant(8.4), &simulator);
  EXPECT_NEAR(simulator.drive().current_a, 1 - std::exp(-1.0), 1e-6);
}

TEST(DriveEffectsTest, TorqueLimitIsFlat) {
  Plant plant = NominalPlant(Rig::kJoint);
  plant.drive.torque_limit_n_m = 10;
  Simulator simulator(plant, kStep_s);
  double peak = 0;
  RunFor(0.05, Constant(0.5), &simulator, [&](const Simulator& s) { peak = std::max(peak, s.drive().torque_n_m); });
  EXPECT_DOUBLE_EQ(peak, 10);
}

TEST(DriveEffectsTest, RoundedLimitStaysBelowTheSharpOne) {
  Plant plant = NominalPlant(Rig::kJoint);
  plant.drive.torque_limit_n_m = 10;
  plant.drive.corner = 20;
  Simulator simulator(plant, kStep_s);
  RunFor(0.05, Constant(0.5), &simulator, [](const Simulator& s) { ASSERT_LE(s.drive().torque_n_m, 10); });
  EXPECT_GT(simulator.drive().torque_n_m, 9.9);
}

TEST(DriveEffectsTest, MotoringPowerStaysBelowTheCurve) {
  Plant plant = NominalPlant(Rig::kJoint);
  plant.drive.power_w = 60;
  Simulator simulator(plant, kStep_s);
  double most = 0, braking = 0;
  RunFor(0.5, Constant(0.8), &simulator, [&](const Simulator& s) {
    const double power = s.drive().torque_n_m * s.w1();
    most = std::max(most, power);
    braking = std::min(braking, power);
  });
  EXPECT_LE(most, 60 * (1 + 1e-3));
  EXPECT_GT(most, 59);
  EXPECT_LT(braking, -60);  // braking is not limited
}

TEST(DriveEffectsTest, DroopTakesItsLossAtPeak) {
  Plant plant = TorqueSource();
  ASSERT_TRUE(SetParameter("torque_constant_droop.loss_at_peak", 0.3, &plant));
  Simulator simulator(plant, kStep_s);
  simulator.Step(Constant(0, 119.6));
  EXPECT_NEAR(simulator.drive().torque_n_m, 0.7 * 119.6, 1e-9);
  EXPECT_NEAR(simulator.drive().estimate_n_m, 119.6, 1e-9);
  Simulator half(plant, kStep_s);
  half.Step(Constant(0, 59.8));
  EXPECT_NEAR(half.drive().torque_n_m, 0.85 * 59.8, 1e-9);
}

TEST(DriveEffectsTest, SupplySagsWithItsTimeConstant) {
  Plant plant = NominalPlant(Rig::kFlexLink);
  plant.drive.sag_ceiling = 2;
  plant.drive.sag_depth = 0.5;
  plant.drive.sag_time_s = 0.3;
  plant.base.inertia_kg_m2 = 1e6;
  Simulator simulator(plant, kStep_s);
  simulator.Step(Constant(2));
  EXPECT_NEAR(simulator.drive().current_a, 2, 1e-3);
  // y' = (i / c - y) / T with i / c = 1 - y / 2: settles at 2/3 with T / 1.5.
  RunFor(0.3 / 1.5 - kStep_s, Constant(2), &simulator);
  EXPECT_NEAR(simulator.drive().current_a, 2 * (1 - (1 - std::exp(-1.0)) / 3), 1e-4);
  RunFor(3, Constant(2), &simulator);
  EXPECT_NEAR(simulator.drive().current_a, 4.0 / 3, 1e-4);
}

TEST(DriveEffectsTest, DeadZoneIsContinuous) {
  for (const double command : {0.05, 0.2, -0.2, 1.0}) {
    Plant plant = NominalPlant(Rig::kFlexLink);
    plant.drive.dead_zone = 0.1;
    Simulator simulator(plant, kStep_s);
    simulator.Step(Constant(command));
    const double expected = std::copysign(std::max(std::abs(command) - 0.1, 0.0), command);
    EXPECT_NEAR(simulator.drive().current_a, expected, 1e-12) << command;
  }
}

TEST(DriveEffectsTest, AsymmetryScalesBySignOfTorque) {
  for (const double asymmetry : {0.1, -0.1}) {
    Plant plant = TorqueSource();
    plant.drive.asymmetry = asymmetry;
    Simulator up(plant, kStep_s), down(plant, kStep_s);
    RunFor(0.1, Constant(0, 2), &up);
    RunFor(0.1, Constant(0, -2), &down);
    EXPECT_NEAR(up.w1() / -down.w1(), (1 + asymmetry) / (1 - asymmetry), 1e-9);
  }
}

TEST(DriveEffectsTest, EveryListedParameterCanBeSet) {
  for (const Rig rig : kRigs) {
    for (const std::string& name : ParameterNames(rig)) {
      Plant plant = NominalPlant(rig);
      const bool motor_gain = name.starts_with("direction_asymmetry") &&
                              (name.find("@motor") != std::string::npos) != name.ends_with(".asymmetry");
      EXPECT_EQ(SetParameter(name, 0.5, &plant), !motor_gain) << name;
    }
    Plant plant = NominalPlant(rig);
    EXPECT_FALSE(SetParameter("viscous_friction.damping", 1, &plant));
    EXPECT_FALSE(SetParameter("coulomb_friction@elbow.friction_n_m", 1, &plant));
  }
}

}  // namespace
}  // namespace gapscope::twin
