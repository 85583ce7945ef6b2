// Gains that the draft finds, against those that made the log.
#include "tests/draft/bench.h"

namespace gapscope::testing {
namespace {

constexpr double kGainsKp = 6, kGainsKd = 0.3;  // N m/rad, N m s/rad
constexpr double kWithin = 0.1;                 // of the gain; the target is held, which is half a row late

class GainsTest : public DraftBench {
 protected:
  static const AddedActuator* Added(const Experiment& e, const std::string& name) {
    for (const auto& a : e.actuators) {
      if (a.name == name) return &a;
    }
    return nullptr;
  }
};

TEST_F(GainsTest, OfTheMeasuredTorque) {
  const Motion m = Move(0, kGainsKp, kGainsKd);
  const Experiment e =
      Drafted(Bars({"hip"}), {{"time", m.time_s}, {"q_des", m.target}, {"q", m.angle}, {"tau", m.torque}});
  const AddedActuator* a = Added(e, "hip");
  ASSERT_NE(a, nullptr) << text_;
  EXPECT_EQ(a->kind, AddedActuator::Kind::kPosition);
  EXPECT_NEAR(a->kp, kGainsKp, kWithin * kGainsKp);
  EXPECT_NEAR(a->kd, kGainsKd, kWithin * kGainsKd);
  EXPECT_EQ(CommandOf(e, "hip"), "q_des");
  EXPECT_EQ(ColumnOf(e, "hip", SignalKind::kTorque), "tau");
  EXPECT_FALSE(IsUnsure("gains")) << text_;
}

TEST_F(GainsTest, OfTheTorqueThatTheMotionTakes) {
  const Motion m = Move(0, kGainsKp, kGainsKd);
  const Experiment e = Drafted(Bars({"hip"}), {{"time", m.time_s}, {"q_des", m.target}, {"q", m.angle}});
  const AddedActuator* a = Added(e, "hip");
  ASSERT_NE(a, nullptr) << text_;
  EXPECT_NEAR(a->kp, kGainsKp, kWithin * kGainsKp);
  EXPECT_NEAR(a->kd, kGainsKd, 2 * kWithin * kGainsKd);
  // Nothing but the link's inertia says how large they are: with a rotor of half of it they are half as large again.
  EXPECT_TRUE(IsUnsure("a rotor that it lacks would make them larger")) << text_;
  // They are parameters that a fit may move; the joint's own damping would be the same as kd.
  for (const auto& p : e.parameters) {
    EXPECT_NE(p.name, "hip.damping");
    EXPECT_TRUE(p.name != "hip.kp" || (!p.frozen && p.low < kGainsKp && p.high > 5 * kGainsKp));
  }
}

// Where gravity turns the joint, it says how large gains are.
TEST_F(GainsTest, OfATorqueWithGravityAreSure) {
  const Motion m = Move(0, kGainsKp, kGainsKd, {.gravity_n_m = 0.981});
  const Experiment e = Drafted(
      "<mujoco><compiler angle=\"radian\"/><worldbody><body><joint name=\"hip\" axis=\"0 1 0\"/><inertial pos=\"0 0 "
      "-0.1\" "
      "mass=\"1\" diaginertia=\"0.01 0.01 0.01\"/></body></worldbody></mujoco>",
      {{"time", m.time_s}, {"q_des", m.target}, {"q", m.angle}});
  ASSERT_NE(Added(e, "hip"), nullptr) << text_;
  EXPECT_NEAR(Added(e, "hip")->kp, kGainsKp, kWithin * kGainsKp);
  EXPECT_FALSE(IsUnsure("gains")) << text_;
}

// A joint that runs into its stops is borne by them there: those rows say nothing of the servo.
TEST_F(GainsTest, AreOfTheMotionBetweenTheStops) {
  const Motion m = Move(0, kGainsKp, kGainsKd, {.gravity_n_m = 0.981, .stop_rad = 0.35});
  const Experiment e = Drafted(
      "<mujoco><compiler angle=\"radian\"/><worldbody><body><joint name=\"hip\" axis=\"0 1 0\" limited=\"true\" "
      "range=\"-0.35 0.35\"/><inertial pos=\"0 0 -0.1\" mass=\"1\" diaginertia=\"0.01 0.01 0.01\"/></body>"
      "</worldbody></mujoco>",
      {{"time", m.time_s}, {"q_des", m.target}, {"q", m.angle}});
  ASSERT_NE(Added(e, "hip"), nullptr) << text_;
  EXPECT_NEAR(Added(e, "hip")->kp, kGainsKp, kWithin * kGainsKp);
  EXPECT_FALSE(IsUnsure("gains")) << text_;
}

TEST_F(GainsTest, AreMadeUpAndMarkedWhereTheLogDoesNotTell) {
  // The joint follows at once: no torque that moves it can be told.
  Motion m = Move(0, kGainsKp, kGainsKd);
  const Experiment e = Drafted(Bars({"hip"}), {{"time", m.time_s}, {"q_des", m.target}, {"q", m.target}});
  const AddedActuator* a = Added(e, "hip");
  ASSERT_NE(a, nullptr) << text_;
  EXPECT_GT(a->kp, 0);
  EXPECT_TRUE(IsUnsure("made up")) << text_;
}

// Of a first log that is too short for it another tells, if it has the same columns.
TEST_F(GainsTest, AreOfAllLogsThatAreAlike) {
  const auto columns = [](const Motion& m, const std::string& angle) {
    return std::vector<Named>{{"time", m.time_s}, {"q_des", m.target}, {angle, m.angle}};
  };
  const Motion brief = Move(0, kGainsKp, kGainsKd, {.rows = 45}), whole = Move(0, kGainsKp, kGainsKd);
  const auto kp = [&](const std::vector<Named>& second) {
    const Experiment e = Drafted(Bars({"hip"}), columns(brief, "q"), {}, second);
    const AddedActuator* a = Added(e, "hip");
    EXPECT_NE(a, nullptr) << text_;
    return a ? a->kp : 0;
  };
  kp({});
  EXPECT_TRUE(IsUnsure("made up")) << text_;
  EXPECT_NEAR(kp(columns(whole, "q")), kGainsKp, kWithin * kGainsKp);
  kp(columns(whole, "angle"));
  EXPECT_TRUE(IsUnsure("made up")) << text_;
}

TEST_F(GainsTest, AsTheUserSaysThem) {
  const Motion m = Move(0, kGainsKp, kGainsKd);
  const DraftOptions said{.servo = ServoSaid{.kp = 17, .kd = 0.4, .limit = 3, .armature = 0.01}};
  const Experiment e = Drafted(Bars({"hip"}), {{"time", m.time_s}, {"q_des", m.target}, {"q", m.angle}}, said);
  const AddedActuator* a = Added(e, "hip");
  ASSERT_NE(a, nullptr) << text_;
  EXPECT_EQ(a->kp, 17);
  EXPECT_EQ(a->kd, 0.4);
  EXPECT_EQ(a->force_limit, 3);
  EXPECT_EQ(a->armature, 0.01);
  EXPECT_FALSE(IsUnsure("gains")) << text_;
}

TEST_F(GainsTest, ALightLinkUnderAStiffServoGetsAnArmature) {
  const Motion m = Move(0, kGainsKp, kGainsKd);
  const DraftOptions stiff{.servo = ServoSaid{.kp = 3000, .kd = 20, .limit = {}, .armature = {}}};
  const std::vector<Named> log = {{"time", m.time_s}, {"q_des", m.target}, {"q", m.angle}};
  Experiment e = Drafted(Bars({"hip"}), log, stiff);
  ASSERT_NE(Added(e, "hip"), nullptr);
  ASSERT_TRUE(Added(e, "hip")->armature.has_value()) << text_;
  // kp h^2 and kd h in inertias: 3000 * 4e-6 / 0.06 = 0.2, 20 * 0.002 / 0.5 = 0.08; the link has 0.02.
  EXPECT_NEAR(*Added(e, "hip")->armature, 0.18, 1e-6);
  EXPECT_TRUE(IsUnsure("armature")) << text_;
  e = Drafted(Bars({"hip"}, "", "armature=\"0.01\""), log, stiff);
  ASSERT_NE(Added(e, "hip"), nullptr);
  EXPECT_FALSE(Added(e, "hip")->armature.has_value()) << "the MJCF says it";
}

}  // namespace
}  // namespace gapscope::testing
