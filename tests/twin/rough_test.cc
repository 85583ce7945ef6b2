// Roughness: it acts as a torque, holds nothing of the catalogue's laws, remembers and drifts as it says.
#include "tests/twin/rough.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/twin/plants.h"

namespace gapscope::twin {
namespace {

constexpr double kPi = std::numbers::pi;

Rough OneWave(double angle, double speed, double phase_rad) {
  Rough rough;
  rough.scale_n_m = 0.4;
  rough.middle_rad = 0.1;
  rough.angle_rad = 0.5;
  rough.speed_rad_per_s = 2;
  rough.terms = {{.amplitude = 1.5, .angle = angle, .speed = speed, .phase_rad = phase_rad}};
  return rough;
}

// A motion that fills angle and speed, as two logs.
JointMotion Lissajous() {
  JointMotion m;
  for (int i = 0; i < 4000; ++i) {
    const double t = 0.005 * i;
    if (i % 2000 == 0) m.begins.push_back(m.angle_rad.size());
    m.session_s.push_back(t);
    m.angle_rad.push_back(0.2 + 0.8 * std::sin(2 * t) + 0.5 * std::sin(3.3 * t));
    m.speed_rad_per_s.push_back(1.6 * std::cos(2 * t) + 1.65 * std::cos(3.3 * t));
    m.drive_n_m.push_back(std::sin(5 * t));
  }
  return m;
}

double Share(const std::vector<double>& torque, const std::vector<double>& law) {
  double product = 0;
  for (std::size_t i = 0; i < law.size(); ++i) product += torque[i] * law[i] / static_cast<double>(law.size());
  return std::abs(product) / (RootMeanSquare(torque) * RootMeanSquare(law));
}

// tau(q) = A sin(a x + p) has the potential A sd / a cos(a x + p): it and the kinetic energy keep their sum.
TEST(RoughTest, AWaveOfTheAngleKeepsEnergy) {
  for (const int joint : {0, 1}) {
    Plant plant = Free(Rig::kFlexLink);
    const Rough rough = OneWave(1.3, 0, 0.7);
    plant.rough[static_cast<std::size_t>(joint)] = rough;
    Simulator simulator(plant, kStep_s);
    simulator.Place(0.3, 1, 0.2, -1);
    const auto energy = [&](const Simulator& s) {
      const double x = ((joint == 0 ? s.q1() : s.q2()) - rough.middle_rad) / rough.angle_rad;
      return s.Energy() + 0.4 * 1.5 * rough.angle_rad / 1.3 * std::cos(1.3 * x + 0.7);
    };
    const double before = energy(simulator);
    RunFor(1, Constant(0), &simulator, [&](const Simulator& s) { EXPECT_NEAR(energy(s), before, 1e-7); });
  }
}

// I w' = A sin(b v): ln tan(b v / 2) grows as A b t / (I sd).
TEST(RoughTest, AWaveOfTheSpeedAcceleratesAsItSays) {
  Plant plant = TorqueSource();
  plant.rough[0] = OneWave(0, 0.8, 0);
  Simulator simulator(plant, kStep_s);
  simulator.Place(0, 0.5, 0, 0);
  RunFor(0.3, Constant(0), &simulator);
  const double rate = 0.4 * 1.5 * 0.8 / (plant.base.inertia_kg_m2 * 2);
  const double start = std::log(std::tan(0.8 * 0.5 / 2 / 2)), end = std::log(std::tan(0.8 * simulator.w1() / 2 / 2));
  EXPECT_NEAR(end - start, rate * 0.3, 1e-6);
}

TEST(RoughTest, NothingIsLeftInTheSpanOfTheLaws) {
  const JointMotion motion = Lissajous();
  Random random(4, 0, "test");
  for (int i = 0; i < 20; ++i) {
    const Rough rough = DrawRough(motion, 0.3, &random);
    const auto torque = Along(rough, motion);
    EXPECT_NEAR(rough.scale_n_m * RootMeanSquare(torque), 0.3, 1e-9);
    std::vector<double> one, angle, sine, cosine, speed, drag;
    for (std::size_t k = 0; k < torque.size(); ++k) {
      const double q = motion.angle_rad[k], w = motion.speed_rad_per_s[k];
      one.push_back(1);
      angle.push_back(q);
      sine.push_back(std::sin(q));
      cosine.push_back(std::cos(q));
      speed.push_back(w);
      drag.push_back(w * std::abs(w));
    }
    for (const auto& law : {one, angle, sine, cosine, speed, drag}) EXPECT_LT(Share(torque, law), 1e-3);
    EXPECT_LE(LargestHold(rough, motion).share, 0.5);
  }
}

TEST(RoughTest, WhatALawHoldsIsGoneOrSeen) {
  const JointMotion motion = Lissajous();
  Rough constant = OneWave(0, 0, 1);
  TakeOutLaws(motion, &constant);
  EXPECT_LT(RootMeanSquare(Along(constant, motion)), 1e-9);
  Rough ripple = OneWave(12 * 0.5, 0, 1);  // of deviations: twelve periods a turn
  TakeOutLaws(motion, &ripple);
  const Hold hold = LargestHold(ripple, motion);
  EXPECT_EQ(hold.law, "cogging");
  EXPECT_GT(hold.share, 0.99);
}

// The play: after a reversal the torque stays until the width is travelled.
TEST(RoughTest, MemoryIsAPlay) {
  Rough rough = OneWave(1, 0, 0);
  rough.memory_rad = 0.2;
  double seen = Remembered(rough, 0, 1);
  EXPECT_DOUBLE_EQ(seen, 0.9);
  EXPECT_DOUBLE_EQ(Remembered(rough, seen, 0.85), 0.9);
  EXPECT_DOUBLE_EQ(Remembered(rough, seen, 0.5), 0.6);
  rough.memory_rad = 0;
  EXPECT_DOUBLE_EQ(Remembered(rough, 0, 1), 1);
}

TEST(RoughTest, DriftGoesOnFromLogToLog) {
  Rough rough = OneWave(0, 0, kPi / 2);
  rough.terms[0].drift_hz = 0.025;
  rough.terms[0].swing = 0.5;
  EXPECT_DOUBLE_EQ(Waves(rough, 0, 0, 0), 1.5);
  EXPECT_DOUBLE_EQ(Waves(rough, 0, 0, 10), 2.25);
  // The same torque in a simulator whose log began ten seconds into the session.
  Plant plant = TorqueSource();
  plant.rough[0] = rough;
  Simulator simulator(plant, kStep_s);
  simulator.SetSession(10);
  simulator.Place(0, 0, 0, 0);
  RunFor(0.01, Constant(0), &simulator);
  EXPECT_NEAR(simulator.w1(), 0.4 * 2.25 * 0.01 / plant.base.inertia_kg_m2, 1e-6);
}

}  // namespace
}  // namespace gapscope::twin
