// Each effect of the joints, the transmission and the load shows its own signature.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/twin/effects.h"
#include "tests/twin/friction.h"
#include "tests/twin/plants.h"

namespace gapscope::twin {
namespace {

constexpr double kInertia = 0.159221308;

class DryTest : public testing::TestWithParam<FrictionLaw> {};

TEST_P(DryTest, CoastDownIsLinearAndStops) {
  Plant plant = TorqueSource();
  plant.dry[0].positive_n_m = plant.dry[0].negative_n_m = 0.5;
  plant.dry[0].law = GetParam();
  Simulator simulator(plant, kStep_s);
  simulator.Place(0, 3, 0, 0);
  // The bristles wind up over a few presliding distances at first.
  RunFor(0.1, Constant(0), &simulator);
  const double w = simulator.w1();
  RunFor(0.4, Constant(0), &simulator);
  EXPECT_NEAR(simulator.w1(), w - 0.4 * 0.5 / kInertia, 1e-6);
  RunFor(2, Constant(0), &simulator);
  EXPECT_NEAR(simulator.w1(), 0, 1e-3);
}

TEST_P(DryTest, SticksBelowItsFrictionAndDeflectsLittle) {
  Plant plant = TorqueSource();
  plant.dry[0].positive_n_m = plant.dry[0].negative_n_m = 0.5;
  plant.dry[0].law = GetParam();
  Simulator simulator(plant, kStep_s);
  RunFor(2, Constant(0, 0.3), &simulator);
  EXPECT_LT(std::abs(simulator.q1()), 3 * plant.dry[0].presliding_rad);
  EXPECT_GT(simulator.q1(), 0);
}

TEST_P(DryTest, StribeckBreaksAwayLater) {
  Plant plant = TorqueSource();
  ASSERT_TRUE(SetParameter("stribeck_friction.friction_n_m", 0.5, &plant));
  ASSERT_TRUE(SetParameter("stribeck_friction.breakaway_n_m", 1.0, &plant));
  ASSERT_TRUE(SetParameter("stribeck_friction.stribeck_speed_rad_per_s", 0.1, &plant));
  plant.dry[0].law = GetParam();
  Simulator still(plant, kStep_s);
  RunFor(1, Constant(0, 0.8), &still);
  EXPECT_LT(std::abs(still.q1()), 0.01);
  RunFor(0.5, Constant(0, 1.2), &still);
  const double w = still.w1();
  EXPECT_GT(w, 0.5);
  RunFor(0.2, Constant(0, 1.2), &still);  // fast: the hump is gone
  EXPECT_NEAR(still.w1() - w, 0.2 * 0.7 / kInertia, 1e-4);
}

TEST_P(DryTest, FrictionDiffersByDirection) {
  Plant plant = TorqueSource();
  plant.dry[0].positive_n_m = 0.2;
  plant.dry[0].negative_n_m = 0.8;
  plant.dry[0].law = GetParam();
  Simulator up(plant, kStep_s), down(plant, kStep_s);
  RunFor(0.2, Constant(0, 1), &up);
  RunFor(0.2, Constant(0, -1), &down);
  const double w_up = up.w1(), w_down = down.w1();  // the bristles are wound up
  RunFor(0.3, Constant(0, 1), &up);
  RunFor(0.3, Constant(0, -1), &down);
  EXPECT_NEAR(up.w1() - w_up, 0.3 * 0.8 / kInertia, 1e-4);
  EXPECT_NEAR(down.w1() - w_down, -0.3 * 0.2 / kInertia, 1e-4);
}

TEST_P(DryTest, LoadFrictionGrowsWithTorque) {
  Plant plant = TorqueSource();
  plant.dry[0].load_coefficient = 0.2;
  plant.dry[0].law = GetParam();
  for (const double torque : {1.0, 4.0}) {
    Simulator simulator(plant, kStep_s);
    RunFor(0.3, Constant(0, torque), &simulator);
    EXPECT_NEAR(simulator.w1(), 0.3 * 0.8 * torque / kInertia, 0.02 * torque);
  }
}

// What has only to follow a limit that moves with the load does not stick, and loses nothing to the sticking elements'
// viscosity.
TEST_P(DryTest, SlidingUnderAChangingLoadMeetsTheLevelAlone) {
  Dry dry;
  dry.load_coefficient = 0.385;
  dry.presliding_rad = 1e-4;
  dry.law = GetParam();
  for (double before = 0.1; before < 1; before += 0.037) {
    for (double now = 0.1; now < 1; now += 0.041) {
      Bristles bristles;
      bristles.Slide(dry, 5, before);
      EXPECT_NEAR(bristles.Torque(dry, 0, 5, now, 0.002), 0.385 * now, 1e-9) << before << " " << now;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Laws, DryTest, testing::Values(FrictionLaw::kMaxwellSlip, FrictionLaw::kLuGre));

TEST(JointEffectsTest, QuadraticDragDecaysHyperbolically) {
  Plant plant = TorqueSource();
  plant.dry[0].drag_n_m_s2_per_rad2 = 0.05;
  Simulator simulator(plant, kStep_s);
  simulator.Place(0, 10, 0, 0);
  RunFor(0.5, Constant(0), &simulator);
  EXPECT_NEAR(simulator.w1(), 10 / (1 + 0.05 / kInertia * 10 * 0.5), 1e-8);
}

TEST(JointEffectsTest, BacklashKeepsSidesWithinTheGap) {
  Plant plant = NominalPlant(Rig::kJoint);
  plant.load.gap_rad = 0.05;
  plant.load.motor_share = 0.4;
  Simulator simulator(plant, kStep_s);
  double widest = 0, flight = 0;
  for (int i = 0; i < 6; ++i) {
    RunFor(0.3, Constant(i % 2 ? 0.3 : -0.3), &simulator, [&](const Simulator& s) {
      const double twist = std::abs(s.motor_rad() - s.q1());
      widest = std::max(widest, twist);
      if (twist < 0.024) flight += kStep_s;
    });
  }
  EXPECT_GT(widest, 0.025);
  EXPECT_LT(widest, 0.025 * 1.2);  // the flanks give a little
  EXPECT_GT(flight, 0.02);
}

TEST(JointEffectsTest, BacklashLoadFliesFreelyInTheGap) {
  Plant plant = Free(Rig::kJoint);
  plant.load.gap_rad = 0.2;
  Simulator simulator(plant, kStep_s);
  simulator.Place(0, 0, 0, 0);
  RunFor(0.2, Constant(0, 0.05), &simulator, [](const Simulator& s) {
    if (s.motor_rad() < 0.1) {
      ASSERT_EQ(s.q1(), 0);
    }
  });
  EXPECT_GT(simulator.motor_rad(), 0.01);
}

TEST(JointEffectsTest, ComplianceRingsAtItsResonance) {
  Plant plant = Free(Rig::kJoint);
  plant.load.stiffness = 900;
  plant.load.motor_share = 0.3;
  plant.load.transmission_damping_ratio = 0;
  Simulator simulator(plant, kStep_s);
  // A short kick on the motor side.
  RunFor(0.001, Constant(0, 50), &simulator);
  const double w = std::sqrt(900 / (kInertia * 0.3 * 0.7));
  const double period = Period(0.5, Constant(0), &simulator, [](const Simulator& s) { return s.motor_rad() - s.q1(); });
  EXPECT_NEAR(period, kTurn / w, 1e-4 * kTurn / w);
}

TEST(JointEffectsTest, SplitConservesMomentumAndEnergy) {
  Plant plant = Free(Rig::kQube);
  plant.load.stiffness = 0.5;
  plant.load.transmission_damping_ratio = 0;
  Simulator simulator(plant, kStep_s);
  simulator.Place(0, 4, 0.5, 0);
  const double energy = simulator.Energy();
  RunFor(2, Constant(0), &simulator);
  EXPECT_NEAR(simulator.Energy(), energy, 1e-7 * std::abs(energy));
}

TEST(JointEffectsTest, CableSwingsAboutItsRest) {
  Plant plant = Free(Rig::kJoint);
  plant.load.cable_stiffness = 2;
  plant.load.cable_rest_rad = 0.3;
  Simulator simulator(plant, kStep_s);
  const double w = std::sqrt(2 / kInertia);
  EXPECT_NEAR(Period(10, Constant(0), &simulator, [](const Simulator& s) { return s.q1(); }, 0.3), kTurn / w, 1e-5);
}

// Let go at a from the rest, J q'' = -k x - c x^3: quarter period K(m) / W, W^2 = (k + c a^2) / J,
// m = c a^2 / 2 (k + c a^2).
TEST(JointEffectsTest, CubicCableSwingsFasterTheFartherFromItsRest) {
  for (const double stiffness : {2.0, 0.0}) {
    for (const double away : {0.4, 0.8}) {
      Plant plant = Free(Rig::kJoint);
      plant.load.cable_stiffness = stiffness;
      ASSERT_TRUE(SetParameter("cable_spring.rest_rad", 0.3, &plant));
      ASSERT_TRUE(SetParameter("cable_spring@joint.stiffness_cubic_n_m_per_rad3", 4, &plant));
      Simulator simulator(plant, kStep_s);
      simulator.Place(0.3 + away, 0, 0, 0);
      const double steepest = stiffness + 4 * away * away, m = 2 * away * away / steepest;
      const double period_s = 4 * std::comp_ellint_1(std::sqrt(m)) / std::sqrt(steepest / kInertia);
      EXPECT_NEAR(Period(
                      10, Constant(0), &simulator, [](const Simulator& s) { return s.q1(); }, 0.3),
                  period_s, 1e-4 * period_s);
    }
  }
}

TEST(JointEffectsTest, CableHysteresisLosesEnergy) {
  Plant plant = Free(Rig::kJoint);
  plant.load.cable_stiffness = 2;
  plant.load.cable_hysteresis = 0.01;
  Simulator simulator(plant, kStep_s);
  simulator.Place(0.4, 0, 0, 0);
  double late_peak = 0;
  RunFor(5, Constant(0), &simulator, [&](const Simulator& s) {
    if (s.time_s() > 3.5) late_peak = std::max(late_peak, std::abs(s.q1()));
  });
  EXPECT_LT(late_peak, 0.35);
  EXPECT_GT(late_peak, 0.1);
}

TEST(JointEffectsTest, GravityOffsetAndBiasHoldStill) {
  Plant plant = TorqueSource();
  plant.load.gravity_n_m = 3;
  plant.load.gravity_rest_rad = 0.4;
  plant.load.bias_n_m = 3 * std::sin(0.2);
  Simulator simulator(plant, kStep_s);
  simulator.Place(0.6, 0, 0, 0);
  RunFor(1, Constant(0), &simulator);
  EXPECT_NEAR(simulator.q1(), 0.6, 1e-12);
}

TEST(JointEffectsTest, CoggingRepeatsWithItsPeriod) {
  Plant plant = TorqueSource();
  plant.load.cogging_n_m = 0.5;
  plant.load.cogging_periods = 8;
  plant.load.cogging_second = 0.2;
  Simulator simulator(plant, kStep_s);
  simulator.Place(0, 4, 0, 0);
  double slowest = 9, fastest = 0, at_one = 0, at_two = 0;
  RunFor(1, Constant(0), &simulator, [&](const Simulator& s) {
    slowest = std::min(slowest, s.w1());
    fastest = std::max(fastest, s.w1());
    if (at_one == 0 && s.q1() > 0.1 + kTurn / 8) at_one = s.w1();
    if (at_two == 0 && s.q1() > 0.1 + 2 * kTurn / 8) at_two = s.w1();
  });
  EXPECT_GT(fastest - slowest, 0.1);
  EXPECT_NEAR(at_one, at_two, 2e-3);  // a conservative torque: the same speed a period later
}

TEST(JointEffectsTest, HardeningRaisesTheFrequencyWithAmplitude) {
  Plant plant = Free(Rig::kFlexLink);
  plant.base.inertia_kg_m2 = 1e6;
  const double k = plant.base.link_stiffness_n_m_per_rad;
  ASSERT_TRUE(SetParameter("spring_hardening.cubic_n_m_per_rad3", k, &plant));
  const auto period = [&](double amplitude) {
    Simulator simulator(plant, kStep_s);
    simulator.Place(0, 0, amplitude, 0);
    return Period(5, Constant(0), &simulator, [](const Simulator& s) { return s.q2(); });
  };
  const double small = period(0.01), large = period(0.4);
  EXPECT_NEAR(1 / small, 2.70, 0.005);
  // Duffing: w = w0 (1 + 3/8 (k3 / k) a^2) to first order.
  EXPECT_NEAR(small / large, 1 + 3.0 / 8 * 0.16, 0.006);
}

TEST(JointEffectsTest, SecondJointHasFrictionOfItsOwn) {
  Plant plant = Free(Rig::kQube);
  plant.base.arm_mass_kg = 1e6;  // the arm stands
  plant.dry[1].positive_n_m = plant.dry[1].negative_n_m = 2e-4;
  Simulator simulator(plant, kStep_s);
  simulator.Place(0, 0, 0.3, 0);
  // Each half swing loses 2 F / (m g l) of amplitude.
  const double loss = 2 * 2e-4 / (0.024 * 9.81 * 0.129 / 2);
  double lowest = 0;
  RunFor(0.45, Constant(0), &simulator, [&](const Simulator& s) { lowest = std::min(lowest, s.q2()); });
  EXPECT_NEAR(lowest, -(0.3 - loss), 2e-3);
}

}  // namespace
}  // namespace gapscope::twin
