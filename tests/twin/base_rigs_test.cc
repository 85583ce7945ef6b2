// The rigs without effects against closed forms of their equations.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/twin/plants.h"

namespace gapscope::twin {
namespace {

constexpr double kIntegration = 1e-7;  // relative, of a fourth-order method at 50 us
constexpr double kCrossing = 2e-5;     // relative, periods from interpolated crossings

TEST(BaseRigsTest, JointStepIsSecondOrderResponse) {
  const Plant plant = NominalPlant(Rig::kJoint);
  Simulator simulator(plant, kStep_s);
  const double w = std::sqrt(157.1451 / 0.159221308);
  const double zeta = (7.0729 + 0.5) / (2 * std::sqrt(0.159221308 * 157.1451));
  const double wd = w * std::sqrt(1 - zeta * zeta);
  RunFor(0.3, Constant(0.2), &simulator, [&](const Simulator& s) {
    const double t = s.time_s();
    const double expected = 0.2 * (1 - std::exp(-zeta * w * t) * (std::cos(wd * t) + zeta * w / wd * std::sin(wd * t)));
    ASSERT_NEAR(s.q1(), expected, kIntegration);
  });
}

TEST(BaseRigsTest, QubeConservesEnergy) {
  Simulator simulator(Free(Rig::kQube), kStep_s);
  simulator.Place(0.1, 3.0, 2.2, -4.0);
  const double energy = simulator.Energy();
  double swing = 0;
  RunFor(3, Constant(5), &simulator, [&](const Simulator& s) { swing = std::max(swing, std::abs(s.w2())); });
  EXPECT_GT(swing, 8);
  EXPECT_NEAR(simulator.Energy(), energy, 1e-9 * std::abs(energy) + 1e-12);
}

TEST(BaseRigsTest, QubeConservesAngularMomentumAboutTheArmAxis) {
  // q1 is cyclic: (I + m L^2 + J sin^2 q2) w1 + m L l cos q2 w2 stays.
  const Plant plant = Free(Rig::kQube);
  const Base& b = plant.base;
  const auto momentum = [&](const Simulator& s) {
    const double j = b.pendulum_mass_kg * b.pendulum_length_m * b.pendulum_length_m / 3;
    return (DrivenInertia(plant) + b.pendulum_mass_kg * b.arm_length_m * b.arm_length_m +
            j * std::pow(std::sin(s.q2()), 2)) *
               s.w1() +
           b.pendulum_mass_kg * b.arm_length_m * b.pendulum_length_m / 2 * std::cos(s.q2()) * s.w2();
  };
  Simulator simulator(plant, kStep_s);
  simulator.Place(0, -2.0, 1.0, 3.0);
  const double before = momentum(simulator);
  RunFor(2, Constant(0), &simulator);
  EXPECT_NEAR(momentum(simulator), before, kIntegration * std::abs(before));
}

TEST(BaseRigsTest, QubeSmallSwingWithFreeArm) {
  const Plant plant = Free(Rig::kQube);
  const Base& b = plant.base;
  const double m22 = b.pendulum_mass_kg * b.pendulum_length_m * b.pendulum_length_m / 3;
  const double m11 = DrivenInertia(plant) + b.pendulum_mass_kg * b.arm_length_m * b.arm_length_m;
  const double m12 = b.pendulum_mass_kg * b.arm_length_m * b.pendulum_length_m / 2;
  const double stiffness = b.pendulum_mass_kg * 9.81 * b.pendulum_length_m / 2;
  const double expected = kTurn / std::sqrt(stiffness * m11 / (m11 * m22 - m12 * m12));
  Simulator simulator(plant, kStep_s);
  simulator.Place(0, 0, 1e-3, 0);
  EXPECT_NEAR(Period(5, Constant(0), &simulator, [](const Simulator& s) { return s.q2(); }), expected,
              kCrossing * expected);
}

TEST(BaseRigsTest, QubeHangingPendulumSwingsAgainstTheArm) {
  Simulator simulator(NominalPlant(Rig::kQube), kStep_s);
  RunFor(0.05, Constant(3), &simulator);
  EXPECT_GT(simulator.q1(), 0);
  EXPECT_LT(simulator.q2(), 0);
}

TEST(BaseRigsTest, FlexJointSteadySpeedUnderVoltage) {
  Simulator simulator(NominalPlant(Rig::kFlexJoint), kStep_s);
  const Base b = NominalBase(Rig::kFlexJoint);
  const double drive = b.efficiency * b.gear * b.kt_n_m_per_a / b.resistance_ohm;
  RunFor(30, Constant(2), &simulator);
  EXPECT_NEAR(simulator.w1(), drive * 2 / (b.damping_n_m_s_per_rad + drive * b.gear * b.km_v_s_per_rad), 1e-6);
}

TEST(BaseRigsTest, FlexJointFreeResonance) {
  const Base b = NominalBase(Rig::kFlexJoint);
  Simulator simulator(Free(Rig::kFlexJoint), kStep_s);
  simulator.Place(0, 0, 0.1, 0);
  const double w = std::sqrt(b.link_stiffness_n_m_per_rad * (b.inertia_kg_m2 + b.link_inertia_kg_m2) /
                             (b.inertia_kg_m2 * b.link_inertia_kg_m2));
  EXPECT_NEAR(Period(4, Constant(0), &simulator, [](const Simulator& s) { return s.q2(); }), kTurn / w,
              kCrossing * kTurn / w);
}

TEST(BaseRigsTest, FlexLinkWithHeavyHubRingsAtItsClampedFrequency) {
  Plant plant = Free(Rig::kFlexLink);
  plant.base.inertia_kg_m2 = 1e6;
  Simulator simulator(plant, kStep_s);
  simulator.Place(0, 0, 0.1, 0);
  EXPECT_NEAR(1 / Period(4, Constant(0), &simulator, [](const Simulator& s) { return s.q2(); }), 2.70, 0.005);
}

TEST(BaseRigsTest, FlexLinkCurrentSpeedsUpTheWhole) {
  Plant plant = NominalPlant(Rig::kFlexLink);
  plant.base.damping_n_m_s_per_rad = 0;
  plant.base.second_damping_n_m_s_per_rad = 0;
  Simulator simulator(plant, kStep_s);
  RunFor(1, Constant(0.5), &simulator);
  const double momentum =
      plant.base.inertia_kg_m2 * simulator.w1() + plant.base.link_inertia_kg_m2 * (simulator.w1() + simulator.w2());
  EXPECT_NEAR(momentum, 0.3338496 * 0.5, kIntegration);
}

}  // namespace
}  // namespace gapscope::twin
