// What is known of effects beyond their equations: containment, rivals, what may stand for another effect's shape.
#include "src/diagnose/rules.h"

#include <gtest/gtest.h>

#include <tuple>

#include "src/diagnose/search.h"
#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

Candidate Of(const Rig& rig, const std::vector<EffectUse>& effects) {
  Candidate candidate{.effects = effects};
  candidate.model = rig.model;
  return candidate;
}

TEST(RulesTest, OnlyEffectsOnOnePlaceContainEachOther) {
  const Rig rig = LoadRig("qube");
  const Candidate bias = Of(rig, {{"torque_bias", "arm"}}), of_joint = Of(rig, {{"direction_asymmetry", "arm"}}),
                  of_motor = Of(rig, {{"direction_asymmetry", "motor"}});
  EXPECT_TRUE(Contains(of_joint, bias));
  EXPECT_FALSE(Contains(of_motor, bias));
  EXPECT_FALSE(Contains(bias, of_joint));
  // So the motor's asymmetry and a bias are rivals, the joint's is no rival of what it contains.
  EXPECT_TRUE(MayBeRivals(of_motor, bias));
  EXPECT_FALSE(MayBeRivals(of_joint, bias));
  // Nearly: a cable that pulls from afar.
  const Candidate cable = Of(rig, {{"cable_spring", "arm"}});
  EXPECT_TRUE(Contains(cable, bias));
  EXPECT_FALSE(Contains(cable, bias, true));
  // Beside the same other effect, and not beside another.
  EXPECT_TRUE(Contains(Of(rig, {{"dead_zone", "motor"}, {"stribeck_friction", "arm"}}),
                       Of(rig, {{"dead_zone", "motor"}, {"coulomb_friction", "arm"}})));
  EXPECT_FALSE(Contains(Of(rig, {{"dead_zone", "motor"}, {"stribeck_friction", "arm"}}),
                        Of(rig, {{"torque_limit", "motor"}, {"coulomb_friction", "arm"}})));
  // In whichever order a pair was found.
  EXPECT_TRUE(Contains(Of(rig, {{"stribeck_friction", "arm"}, {"dead_zone", "motor"}}),
                       Of(rig, {{"dead_zone", "motor"}, {"coulomb_friction", "arm"}})));
  EXPECT_FALSE(Contains(bias, bias));
}

TEST(RulesTest, ABiasIsNoFindingOnAPositionServo) {
  // A servo of MuJoCo's own and one of the duty law; a voltage drive, and a drive of the position law whose logs need
  // not use its gain.
  for (const auto& [name, joint, finding] : {std::tuple{"joint", "joint", false},
                                             {"xl330", "joint", false},
                                             {"qube", "arm", true},
                                             {"ak80", "joint", true}}) {
    const Rig rig = LoadRig(name);
    EXPECT_EQ(IsFinding({"torque_bias", joint}, *rig.model), finding) << name;
    EXPECT_TRUE(IsFinding({"quadratic_drag", joint}, *rig.model)) << name;
  }
}

TEST(RulesTest, TwoLateSensorsAreNoRivalOfALateCommand) {
  const Rig rig = LoadRig("qube");
  const Candidate sensors = Of(rig, {{"sensor_delay", "arm_rad"}, {"sensor_delay", "pendulum_rad"}}),
                  command = Of(rig, {{"sensor_delay", "arm_rad"}, {"command_delay", "motor"}});
  EXPECT_TRUE(IsLessLikely(sensors, command));
  EXPECT_FALSE(IsLessLikely(command, sensors));
  EXPECT_FALSE(MayBeRivals(sensors, command));
  // One of each cannot be told on a rig that logs one signal: rivals.
  EXPECT_TRUE(MayBeRivals(Of(rig, {{"sensor_delay", "arm_rad"}}), Of(rig, {{"command_delay", "motor"}})));
}

// A soft spring, at a hundredth of the stiff end of its range of four decades, is no bound.
TEST(RulesTest, OnlyTheEndOfARangeIsStretched) {
  const PlacedParameter stiffness{
      .name = {}, .key = {}, .unit = {}, .neutral = 3000, .low = 0.5, .high = 3000, .start = 100, .trials = {}};
  EXPECT_FALSE(IsStretched(stiffness, 2));
  EXPECT_TRUE(IsStretched(stiffness, 0.5));
  EXPECT_FALSE(IsStretched(stiffness, 3000)) << "no effect";
  const PlacedParameter angle{
      .name = {}, .key = {}, .unit = {}, .neutral = 0, .low = -2, .high = 2, .start = 0.1, .trials = {}};
  EXPECT_TRUE(IsStretched(angle, -2));
  EXPECT_TRUE(IsStretched(angle, 1.999));
  EXPECT_FALSE(IsStretched(angle, 1.9));
}

TEST(RulesTest, AConstantSupplyIsNoSecondCommand) {
  Recording servo;
  servo.measured.resize(1);
  servo.commands = {{.actuator = "motor", .column = "goal", .values = {0, 1, 0}},
                    {.actuator = "motor.supply", .values = {7, 7, 7}}};
  EXPECT_TRUE(IsOneSignal({servo}));
  Recording supplied = servo;
  supplied.commands[1].values[2] = 6;
  EXPECT_FALSE(IsOneSignal({servo, supplied}));
  servo.measured.resize(2);
  EXPECT_FALSE(IsOneSignal({servo}));
}

TEST(RulesTest, ComplianceMayBeFrictionsElasticGive) {
  const Rig rig = LoadRig("qube");
  EXPECT_TRUE(IsShape({"joint_compliance", "arm"}, {"coulomb_friction", "arm"}, *rig.model));
  EXPECT_TRUE(IsShape({"joint_compliance", "arm"}, {"stribeck_friction", "pendulum"}, *rig.model));
  EXPECT_TRUE(IsShape({"joint_compliance", "arm"}, {"direction_asymmetry", "arm"}, *rig.model));
  EXPECT_FALSE(IsShape({"joint_compliance", "arm"}, {"direction_asymmetry", "motor"}, *rig.model));
  EXPECT_FALSE(IsShape({"joint_compliance", "arm"}, {"torque_bias", "arm"}, *rig.model));
  EXPECT_FALSE(IsShape({"cable_spring", "arm"}, {"coulomb_friction", "arm"}, *rig.model));
}

// Below the noise there is nothing left to tell two explanations apart by.
TEST(RulesTest, ExplanationsAtTheNoiseAreRivals) {
  Candidate a, b;
  a.block_floor = b.block_floor = 1;
  a.train_blocks = a.held_out_blocks = std::vector<double>(40, 0.3);
  b.train_blocks = b.held_out_blocks = std::vector<double>(40, 0.6);
  a.held_out_floors = 0.55, b.held_out_floors = 0.77;
  EXPECT_TRUE(AreRivals(a, b));
  b.train_blocks = b.held_out_blocks = std::vector<double>(40, 4);
  b.held_out_floors = 2;
  EXPECT_FALSE(AreRivals(a, b));
}

TEST(RulesTest, AFirstEffectNeedsMoreWhereTheBaseModelIsAtTheNoise) {
  Candidate base;
  base.held_out_floors = 0.95;
  EXPECT_GT(FirstLimits(base).share, 0.2);
  base.held_out_floors = 1.5;
  EXPECT_GT(FirstLimits(base).share, 0.05);
  base.held_out_floors = 3;
  EXPECT_LT(FirstLimits(base).share, 0.02);
}

}  // namespace
}  // namespace gapscope::testing
