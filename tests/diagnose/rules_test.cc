// What is known of effects beside each other: containment, findings, what is one motion.
#include "src/diagnose/rules.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <tuple>

#include "src/diagnose/candidate.h"
#include "tests/experiment/scratch.h"
#include "tests/model/synthetic.h"
#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

TEST(RulesTest, OnlyEffectsOnOnePlaceContainEachOther) {
  const Rig rig = LoadRig("qube");
  const EffectUse bias{"torque_bias", "arm"}, of_joint{"direction_asymmetry", "arm"},
      of_other{"direction_asymmetry", "motor"};
  const auto& known = *rig.model->rig();
  EXPECT_TRUE(Contains(of_joint, bias, known));
  EXPECT_FALSE(Contains(of_other, bias, known));
  EXPECT_FALSE(Contains(bias, of_joint, known));
  EXPECT_FALSE(Contains(bias, bias, known));
  // Nearly: a cable that pulls from afar.
  EXPECT_TRUE(Contains({"cable_spring", "arm"}, bias, known));
  EXPECT_FALSE(Contains({"cable_spring", "arm"}, bias, known, true));
  const EffectUse coulomb{"coulomb_friction", "arm"};
  EXPECT_TRUE(IsUsual({"stribeck_friction", "arm"}, coulomb, known)) << "a hump at low speed";
  EXPECT_FALSE(IsUsual({"stribeck_friction", "pendulum"}, coulomb, known));
  EXPECT_FALSE(IsUsual({"direction_asymmetry", "arm"}, coulomb, known)) << "mostly alike both ways";
}

// What a richer effect usually is beyond a simpler one (UsualBeyond) has a value for each of its parameters.
TEST(RulesTest, StartsFromASimplerEffectAreWholeAndOfOneThatIsContained) {
  int with_starts = 0;
  for (const Effect& effect : Catalogue()) {
    if (effect.starts_from.starts.empty()) continue;
    ++with_starts;
    EXPECT_NE(std::ranges::find(effect.contains, effect.starts_from.effect, &Contained::effect), effect.contains.end())
        << effect.name;
    for (const auto& start : effect.starts_from.starts)
      EXPECT_EQ(start.size(), effect.parameters.size()) << effect.name;
  }
  EXPECT_GT(with_starts, 0);
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

// One of each cannot be told where one signal is all that is logged.
TEST(RulesTest, ALateSensorIsALateCommandOnOneSignal) {
  const Rig rig = LoadRig("qube");
  const EffectUse sensor{"sensor_delay", "arm_rad"}, command{"command_delay", "motor"};
  EXPECT_TRUE(AreOneMotion(sensor, command, *rig.model, {.one = true}));
  EXPECT_FALSE(AreOneMotion(sensor, command, *rig.model, {.one = false}));
}

// A log of one command and one signal, by these clocks.
Recording LoggedBy(const std::string& command, const std::string& measured) {
  Recording log;
  log.commands.push_back({.actuator = "motor", .column = "u", .values = {0, 1}, .clock = command});
  log.measured.push_back({.values = {0, 1}, .clock = measured});
  return log;
}

TEST(RulesTest, TheWorstClockOfAnyLogIsToldWithWhatIsLate) {
  const auto clocks = [](const std::vector<Recording>& logs) { return WhatIsLogged(logs).clocks; };
  EXPECT_EQ(clocks({LoggedBy("", "")}), Clocks::kOne) << "a CSV file says nothing";
  EXPECT_EQ(clocks({LoggedBy("header", "header"), LoggedBy("receive", "receive")}), Clocks::kOne);
  EXPECT_EQ(clocks({LoggedBy("header", "header"), LoggedBy("receive", "header")}), Clocks::kMixed);
  EXPECT_EQ(clocks({LoggedBy("receive", "header"), LoggedBy("synthetic", "synthetic")}), Clocks::kMadeUp);
  Recording constant = LoggedBy("receive", "header");
  constant.commands.front().column.reset();
  EXPECT_EQ(clocks({constant}), Clocks::kOne) << "a command without a column has no clock";
  EXPECT_EQ(CaveatOf(Clocks::kOne), "");
  EXPECT_NE(CaveatOf(Clocks::kMixed), CaveatOf(Clocks::kMadeUp));
}

TEST(RulesTest, EffectsOfTimeAreThoseThatAClockImitates) {
  std::set<std::string> of_time;
  for (const Effect& effect : Catalogue()) {
    if (effect.of_time) of_time.insert(effect.name);
  }
  EXPECT_EQ(of_time, (std::set<std::string>{"actuator_lag", "command_delay", "sensor_delay", "torque_delay"}));
}

// A rig of two drives on separate joints, servos or motors.
std::shared_ptr<const Model> TwoDrives(const std::string& kind) {
  const Scratch scratch;
  scratch.Write("robot.xml", R"(<mujoco><worldbody>
    <body><joint name="shoulder"/><geom size="0.1"/></body><body><joint name="elbow"/><geom size="0.1"/></body>
    <body><joint name="free"/><geom size="0.1"/></body></worldbody>
    <actuator><)" + kind + R"( name="first" joint="shoulder"/><)" +
                                 kind + R"( name="second" joint="elbow"/></actuator></mujoco>)");
  const auto experiment = LoadExperiment(scratch.Write("experiment.yaml", R"(model: robot.xml
commands: [{actuator: first, column: u}, {actuator: second, column: v}]
measured:
  - {signal: q, column: q, joint: shoulder, unit: rad}
  - {signal: p, column: p, joint: elbow, unit: rad}
)"));
  EXPECT_TRUE(experiment.ok()) << experiment.error().Text();
  return Model::Load(experiment.value()).value();
}

TEST(RulesTest, OneSizeForAllIsARivalOfTheSameEffectOnOnePlace) {
  const auto model = TwoDrives("motor");
  const auto& known = *model->rig();
  const EffectUse all{"coulomb_friction", "all"}, one{"coulomb_friction", "elbow"}, passive{"coulomb_friction", "free"};
  EXPECT_TRUE(Contains(all, one, known));
  EXPECT_FALSE(Contains(all, one, known, true)) << "the other drive feels it too";
  EXPECT_FALSE(Contains(one, all, known));
  EXPECT_FALSE(Contains(all, passive, known));
  EXPECT_TRUE(Contains({"stribeck_friction", "all"}, all, known));
  EXPECT_FALSE(Contains({"stribeck_friction", "all"}, one, known));
}

TEST(RulesTest, ABiasOfAllServosIsNoFinding) {
  const EffectUse bias{"torque_bias", "all"};
  const auto servos = TwoDrives("position"), motors = TwoDrives("motor");
  EXPECT_FALSE(IsFinding(bias, *servos));
  EXPECT_TRUE(IsFinding(bias, *motors));
  EXPECT_FALSE(IsLessLikely({"gravity_offset", "all"}, {"cable_spring", "all"}, *motors));
}

// However many signals there are.
TEST(RulesTest, AllSensorsLateAreAllCommandsLate) {
  const auto model = TwoDrives("motor");
  const EffectUse sensors{"sensor_delay", "all"}, commands{"command_delay", "all"};
  EXPECT_TRUE(AreOneMotion(sensors, commands, *model, {}));
  EXPECT_FALSE(AreOneMotion(sensors, {"command_delay", "first"}, *model, {}));
  EXPECT_FALSE(AreOneMotion({"sensor_delay", "q"}, commands, *model, {}));
  const Rig one_drive = LoadRig("qube");
  EXPECT_TRUE(AreOneMotion(sensors, {"command_delay", "motor"}, *one_drive.model, {}));
}

// On a servo a constant load is a zero offset, unless its torque is measured.
TEST(RulesTest, FrictionByDirectionIsCoulombFrictionOnAServo) {
  const EffectUse plain{"coulomb_friction", "joint"}, by_direction{"direction_asymmetry", "joint"};
  const Rig servo = LoadRig("joint");
  EXPECT_TRUE(AreOneMotion(plain, by_direction, *servo.model, {}));
  EXPECT_FALSE(AreOneMotion(plain, by_direction, *servo.model, {.torque = true}));
  const Rig drive = LoadRig("qube");
  EXPECT_FALSE(AreOneMotion({"coulomb_friction", "arm"}, {"direction_asymmetry", "arm"}, *drive.model, {}));
}

// By the catalogue, whichever of the two lists the other one, on a joint with its drive and its signals.
TEST(RulesTest, PartnersAreWhatIsMistakenForTheEffect) {
  const Rig rig = LoadRig("qube");
  const auto are = [&](const EffectUse& a, const EffectUse& b) {
    const bool both = ArePartners(a, b, *rig.model);
    EXPECT_EQ(ArePartners(b, a, *rig.model), both) << a.Text() << ", " << b.Text();
    return both;
  };
  EXPECT_TRUE(are({"cable_spring", "arm"}, {"gravity_offset", "arm"}));
  EXPECT_FALSE(are({"cable_spring", "arm"}, {"gravity_offset", "pendulum"})) << "another joint";
  EXPECT_TRUE(are({"command_delay", "motor"}, {"sensor_delay", "arm_rad"}));
  EXPECT_FALSE(are({"command_delay", "motor"}, {"sensor_delay", "pendulum_rad"}));
  EXPECT_TRUE(are({"dead_zone", "motor"}, {"coulomb_friction", "arm"}));
  EXPECT_FALSE(are({"cable_spring", "arm"}, {"coulomb_friction", "arm"}));
}

TEST(RulesTest, GravityIsUnlikelyOnAnUprightAxis) {
  const Rig rig = LoadRig("qube");
  EXPECT_TRUE(IsLessLikely({"gravity_offset", "arm"}, {"cable_spring", "arm"}, *rig.model));
  EXPECT_FALSE(IsLessLikely({"cable_spring", "arm"}, {"gravity_offset", "arm"}, *rig.model));
  EXPECT_FALSE(IsLessLikely({"gravity_offset", "pendulum"}, {"cable_spring", "pendulum"}, *rig.model));
}

// A soft spring, at a hundredth of the stiff end of its range of four decades, is no bound.
// On a positive range in the logarithm, elsewhere in the value itself.
TEST(BoundTest, LiesAtTheEndOfARange) {
  EXPECT_EQ(BoundOf(0.5, 0.5, 3000), OnBound::kLow);
  EXPECT_EQ(BoundOf(2, 0.5, 3000), OnBound::kNo);
  EXPECT_EQ(BoundOf(3000, 0.5, 3000), OnBound::kHigh);
  EXPECT_EQ(BoundOf(-2, -2, 2), OnBound::kLow);
  EXPECT_EQ(BoundOf(1.9, -2, 2), OnBound::kNo);
  EXPECT_EQ(BoundOf(1.999, -2, 2), OnBound::kHigh);
}

TEST(RulesTest, ASensorThatIsNotLoggedHasNoEffect) {
  const Rig rig = LoadRig("joint");
  Recording log;
  log.measured.resize(2);
  log.measured[0].spec = {.signal = "position_rad", .scored = true};
  log.measured[1].spec = {.signal = "torque_n_m", .scored = false};
  const LoggedSignals logged = WhatIsLogged({log});
  const auto& known = *rig.model->rig();
  EXPECT_FALSE(IsOfMissingSensor({"sensor_delay", "position_rad"}, known, logged));
  EXPECT_TRUE(IsOfMissingSensor({"sensor_delay", "velocity_rad_per_s"}, known, logged));
  EXPECT_TRUE(IsOfMissingSensor({"sensor_delay", "torque_n_m"}, known, logged)) << "not scored";
  EXPECT_FALSE(IsOfMissingSensor({"command_delay", "motor"}, known, logged));
}

// A servo's arm with a gripper whose one finger is tied to the other, two that are only tied to each other, one that is
// free, and a loose tip.
TEST(RulesTest, JointsThatNothingMeasuredFollowsAreOutOfSight) {
  const auto slide = [](const std::string& name) {
    return "<body><joint name='" + name + "' type='slide'/><geom size='0.01'/></body>";
  };
  const std::string tip = "<body name='tip'><joint name='tip'/><geom size='0.01'/><site name='imu'/></body>";
  const std::string mjcf =
      "<mujoco><worldbody><body><joint name='base'/><geom size='0.1'/><body><joint name='arm'/><geom size='0.1'/>" +
      slide("left") + slide("right") + slide("a") + slide("b") + slide("free") + tip +
      "</body></body></worldbody><equality><joint joint1='left' joint2='right'/><joint joint1='a' "
      "joint2='b'/></equality>"
      "<tendon><fixed name='cord'><joint joint='right' coef='1'/></fixed></tendon>"
      "<actuator><motor name='arm' joint='arm'/><motor name='grip' tendon='cord'/></actuator>"
      "<sensor><gyro name='imu' site='imu'/></sensor></mujoco>";
  const auto out_of_sight = [&](const std::string& measured) {
    const Scratch scratch;
    const Experiment experiment = MakeExperiment(scratch, mjcf, "measured: [" + measured + "]\n");
    const auto model = MakeModel(experiment);
    return JointsOutOfSight(*model, {MakeRecording(experiment, 10, 0.01, {})});
  };
  using Joints = std::set<std::string>;
  EXPECT_EQ(out_of_sight("{signal: q, column: q, joint: arm, unit: rad}"), (Joints{"a", "b", "free", "tip"}))
      << "the base carries the arm, the fingers are driven or tied to one that is";
  EXPECT_EQ(out_of_sight("{signal: q, column: q, joint: base, unit: rad}"), (Joints{"a", "b", "free", "tip"}));
  EXPECT_EQ(out_of_sight("{signal: w, columns_of_elements: [x, y, z], sensor: imu, unit: rad/s}"),
            (Joints{"a", "b", "free"}));
  EXPECT_EQ(out_of_sight("{signal: q, column: q, joint: tip, unit: rad}, {signal: f, column: f, joint: free, unit: m}"),
            (Joints{"a", "b"}));
}

TEST(RulesTest, AConstantSupplyIsNoSecondCommand) {
  Recording servo;
  servo.measured.resize(1);
  servo.commands = {{.actuator = "motor", .column = "goal", .values = {0, 1, 0}},
                    {.actuator = "motor.supply", .values = {7, 7, 7}}};
  EXPECT_TRUE(WhatIsLogged({servo}).one);
  Recording supplied = servo;
  supplied.commands[1].values[2] = 6;
  EXPECT_FALSE(WhatIsLogged({servo, supplied}).one);
  servo.measured.resize(2);
  EXPECT_FALSE(WhatIsLogged({servo}).one);
}

}  // namespace
}  // namespace gapscope::testing
