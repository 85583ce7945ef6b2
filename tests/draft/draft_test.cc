// Which column goes where: by names, numbers, order and data, against the columns that made the log.
#include "tests/draft/bench.h"

namespace gapscope::testing {
namespace {

const std::vector<std::string> kThree = {"hip", "knee", "left foot"};
constexpr double kKp = 6, kKd = 0.3;

class DraftTest : public DraftBench {
 protected:
  DraftTest() {
    for (std::size_t i = 0; i < kThree.size(); ++i) motions_.push_back(Move(i, kKp, kKd));
  }
  // Targets, angles, speeds of the three joints under names NAME + `ends`; an empty name: none.
  std::vector<Named> Columns(const std::string& target, const std::string& angle, const std::string& speed,
                             const std::vector<std::string>& ends) const {
    std::vector<Named> columns = {{"time", motions_[0].time_s}};
    for (std::size_t i = 0; i < ends.size(); ++i) {
      if (!target.empty()) columns.push_back({target + ends[i], motions_[i].target});
      if (!speed.empty()) columns.push_back({speed + ends[i], motions_[i].speed});
      if (!angle.empty()) columns.push_back({angle + ends[i], motions_[i].angle});
    }
    return columns;
  }
  void ExpectPairs(const Experiment& e, const std::string& target, const std::string& angle, const std::string& speed,
                   const std::vector<std::string>& ends) const {
    for (std::size_t i = 0; i < ends.size(); ++i) {
      EXPECT_EQ(ColumnOf(e, kThree[i]), angle + ends[i]) << text_;
      if (!target.empty()) {
        EXPECT_EQ(CommandOf(e, kThree[i]), target + ends[i]) << text_;
      }
      if (!speed.empty()) {
        EXPECT_EQ(ColumnOf(e, kThree[i], SignalKind::kVelocity), speed + ends[i]) << text_;
      }
    }
  }
  std::vector<Motion> motions_;
};

TEST_F(DraftTest, ByNumber) {
  for (const auto& [target, angle, speed] :
       {std::array{"q_des", "q", "dq"}, {"pos_con", "pos_meas", "vel_meas"}, {"goal_", "angle_", "w_"}}) {
    for (const std::vector<std::string>& ends :
         {std::vector<std::string>{"1", "2", "3"}, {"[0]", "[1]", "[2]"}, {"11", "12", "13"}}) {
      const Experiment e = Drafted(Bars(kThree), Columns(target, angle, speed, ends));
      ExpectPairs(e, target, angle, speed, ends);
      EXPECT_EQ(e.actuators.size(), 3u);
      EXPECT_FALSE(IsUnsure("is taken for")) << text_;
    }
  }
}

TEST_F(DraftTest, ByNameWhateverTheOrder) {
  std::vector<Named> columns = Columns("target/", "q/", "", {"hip", "knee", "left foot"});
  std::ranges::reverse(columns);
  const Experiment e = Drafted(Bars(kThree), columns);
  ExpectPairs(e, "target/", "q/", "", {"hip", "knee", "left foot"});
  EXPECT_FALSE(IsUnsure("is taken for")) << text_;
}

// A gripper's finger, say: the logs say nothing of it.
TEST_F(DraftTest, WhatNothingMovesOrMeasuresHasNoParameters) {
  std::vector<std::string> names = kThree;
  names.emplace_back("finger");
  const std::vector<Named> columns = Columns("target/", "q/", "", {"hip", "knee", "left foot"});
  const auto of_finger = [](const Parameter& p) { return p.name.starts_with("finger"); };
  EXPECT_TRUE(std::ranges::none_of(Drafted(Bars(names), columns).parameters, of_finger)) << text_;
  EXPECT_NE(text_.find("# Neither driven, measured nor sprung, so without parameters here: finger\n"), text_.npos);
  const Experiment sprung = Drafted(Bars(names, "", "stiffness='2'"), columns);
  EXPECT_TRUE(std::ranges::any_of(sprung.parameters, of_finger)) << text_;
}

// 1 kg at 0.2 m of the joint is 1.96 N m.
TEST_F(DraftTest, DryFrictionHasRoomUpToTheWeight) {
  const auto most = [&](const std::string& friction) {
    const Experiment e = Drafted(Bars(kThree, "", "pos='0.2 0 0' frictionloss='" + friction + "'"),
                                 Columns("target/", "q/", "", kThree));
    const auto at = std::ranges::find(e.parameters, "hip.frictionloss", &Parameter::name);
    return at == e.parameters.end() ? 0 : at->high;
  };
  EXPECT_NEAR(most("0.1"), 0.2 * 9.81, 1e-5) << text_;
  EXPECT_NEAR(most("0.5"), 5, 1e-9);
}

TEST_F(DraftTest, ForeignNamesGoByOrderAndSaySo) {
  const std::vector<std::string> ends = {"Rotation", "Pitch", "Jaw"};
  const Experiment e = Drafted(Bars(kThree), Columns("control/positions/", "positions/", "velocities/", ends));
  ExpectPairs(e, "control/positions/", "positions/", "velocities/", ends);
  EXPECT_TRUE(IsUnsure("no name fits 'positions/*'")) << text_;
}

TEST_F(DraftTest, WhereNamesSayNothingTheCommandLeads) {
  const Experiment e = Drafted(Bars(kThree), Columns("x", "y", "", {"1", "2", "3"}));
  ExpectPairs(e, "x", "y", "", {"1", "2", "3"});
  EXPECT_TRUE(IsUnsure("'x*' leads the angle")) << text_;
  const Experiment swapped = Drafted(Bars(kThree), Columns("y", "x", "", {"1", "2", "3"}));
  ExpectPairs(swapped, "y", "x", "", {"1", "2", "3"});
  const Experiment three = Drafted(Bars(kThree), Columns("x", "y", "z", {"1", "2", "3"}));
  ExpectPairs(three, "x", "y", "z", {"1", "2", "3"});
}

TEST_F(DraftTest, ASpeedIsTheDerivativeOfItsAngle) {
  // By number they would be another joint's.
  std::vector<Named> columns = Columns("", "q", "", {"1", "2", "3"});
  columns.push_back({"speed_a", motions_[2].speed});
  columns.push_back({"speed_b", motions_[0].speed});
  const Experiment e = Drafted(Bars(kThree), columns);
  EXPECT_EQ(ColumnOf(e, "left foot", SignalKind::kVelocity), "speed_a") << text_;
  EXPECT_EQ(ColumnOf(e, "hip", SignalKind::kVelocity), "speed_b") << text_;
  EXPECT_EQ(ColumnOf(e, "knee", SignalKind::kVelocity), "") << text_;
}

TEST_F(DraftTest, ARunnerUpIsNamed) {
  std::vector<Named> columns = Columns("", "q", "", {"1", "2", "3"});
  for (std::size_t i = 0; i < 3; ++i)
    columns.push_back({"q_motor" + std::to_string(i + 1), Times(motions_[i].angle, 1.1)});
  Drafted(Bars(kThree), columns);
  EXPECT_TRUE(IsUnsure(", not 'q")) << text_;
}

// "q_d" is a desired "q" whatever else the model has, and "q_d" that is its derivative a speed.
TEST_F(DraftTest, ALetterBehindAnAnglesNameIsItsTargetOrItsSpeed) {
  std::vector<std::string> names = kThree;
  names.emplace_back("finger");
  std::vector<Named> columns = Columns("q_d", "q", "", {"[0]", "[1]", "[2]"});
  columns.push_back({"grip_cmd", motions_[1].target});
  Experiment e = Drafted(Bars(names), columns);
  ExpectPairs(e, "q_d", "q", "", {"[0]", "[1]", "[2]"});
  e = Drafted(Bars(kThree), Columns("", "q", "q_d", {"[0]", "[1]", "[2]"}));
  ExpectPairs(e, "", "q", "q_d", {"[0]", "[1]", "[2]"});
}

// Where names pair a family, the member that no name pairs is of something else: a telescope of several joints, say.
TEST_F(DraftTest, AnOutsiderOfANamedFamilyGoesNowhereAndIsTold) {
  std::vector<std::string> names = kThree;
  names.insert(names.begin(), {"wheel", "wheel2"});
  std::vector<Named> columns = Columns("cmd_", "pos_", "", {"hip", "knee", "left foot"});
  columns.push_back({"pos_arm", motions_[0].speed});
  const Experiment e = Drafted(Bars(names), columns);
  ExpectPairs(e, "cmd_", "pos_", "", {"hip", "knee", "left foot"});
  EXPECT_EQ(ColumnOf(e, "wheel"), "") << text_;
  EXPECT_NE(text_.find("# Columns without a place here: 'pos_arm'\n"), text_.npos) << text_;
}

// Two arms: numbers of a family count the joints of its side, whose own numbers are there twice.
TEST_F(DraftTest, NumbersCountThePartThatTheFamilyNames) {
  const std::vector<std::string> names = {"left_j1", "left_j2", "left_j3", "right_j1", "right_j2", "right_j3"};
  std::vector<Named> columns = {{"time", motions_[0].time_s}};
  for (std::size_t i = 0; i < 3; ++i) {
    for (const std::string side : {"right", "left"}) {
      const Motion m = Move(side == "left" ? i : i + 3, kKp, kKd);
      columns.push_back({side + "_cmd[" + std::to_string(i) + "]", m.target});
      columns.push_back({side + "_pos[" + std::to_string(i) + "]", m.angle});
    }
  }
  const Experiment e = Drafted(Bars(names), columns);
  for (const std::string& name : names) {
    const std::string side = name.substr(0, name.find('_')), end = std::string(1, static_cast<char>(name.back() - 1));
    EXPECT_EQ(ColumnOf(e, name), side + "_pos[" + end + "]") << text_;
    EXPECT_EQ(CommandOf(e, name), side + "_cmd[" + end + "]") << text_;
  }
  EXPECT_FALSE(IsUnsure("is taken for")) << text_;
}

TEST_F(DraftTest, WhatAllNamesShareMayBeLeftOut) {
  const std::vector<std::string> names = {"rh_FFJ2", "rh_FFJ1", "rh_THJ2"};
  const Experiment e = Drafted(Bars(names), Columns("cmd.", "state.", "", {"FFJ2", "FFJ1", "THJ2"}));
  for (const std::string& name : names) {
    EXPECT_EQ(ColumnOf(e, name), "state." + name.substr(3)) << text_;
    EXPECT_EQ(CommandOf(e, name), "cmd." + name.substr(3)) << text_;
  }
  EXPECT_FALSE(IsUnsure("is taken for")) << text_;
}

TEST_F(DraftTest, SidesMayBeLetters) {
  const std::vector<std::string> names = {"left_knee", "right_knee", "left_hip"};
  std::vector<Named> columns = Columns("u_", "q_", "", {"l_knee", "r_knee", "L_hip"});
  std::ranges::reverse(columns);
  const Experiment e = Drafted(Bars(names), columns);
  EXPECT_EQ(ColumnOf(e, "left_knee"), "q_l_knee") << text_;
  EXPECT_EQ(ColumnOf(e, "right_knee"), "q_r_knee") << text_;
  EXPECT_EQ(CommandOf(e, "left_hip"), "u_L_hip") << text_;
  EXPECT_FALSE(IsUnsure("is taken for")) << text_;
}

// Unless only one place is left for it.
TEST_F(DraftTest, TheLastCommandGoesToTheLastActuator) {
  std::vector<std::string> names = kThree;
  names.emplace_back("tool");
  std::string servos = "<actuator>";
  for (const std::string& name : names) servos += "<position kp=\"6\" name=\"" + name + "\" joint=\"" + name + "\"/>";
  std::vector<Named> columns = Columns("cmd_", "pos_", "", {"hip", "knee", "left foot"});
  columns.push_back({"cmd_gripper", motions_[0].torque});
  const Experiment e = Drafted(Bars(names, servos + "</actuator>"), columns);
  EXPECT_EQ(CommandOf(e, "tool"), "cmd_gripper") << text_;
  EXPECT_TRUE(IsUnsure("order")) << text_;
}

TEST_F(DraftTest, WhatDoesNotSayWhatItIsIsNoRunnerUp) {
  std::vector<Named> columns = Columns("", "pos_", "", {"1", "2", "3"});
  for (std::size_t i = 0; i < 3; ++i) columns.push_back({"load_" + std::to_string(i + 1), motions_[i].torque});
  for (std::size_t i = 0; i < 3; ++i) columns.push_back({"aux_" + std::to_string(i + 1), motions_[i].torque});
  ExpectPairs(Drafted(Bars(kThree), columns), "", "pos_", "", {"1", "2", "3"});
  EXPECT_FALSE(IsUnsure(", not '")) << text_;
}

// The bar at 1 m is tied to the first one's end; nobody measures it.
TEST_F(DraftTest, AnOpenLoopIsTold) {
  const std::string tied = "<equality><connect body1=\"a\" body2=\"b\" anchor=\"0.5 0 0\"/></equality>";
  std::string robot = Bars({"hip", "knee"}, tied);
  for (const char* name : {"a", "b"})
    robot.replace(robot.find("<body pos"), 9, std::string("<body name=\"") + name + "\" pos");
  const auto open = [&](double start) {
    Drafted(robot, {{"time", motions_[0].time_s}, {"hip", Times(motions_[0].angle, 1, start - motions_[0].angle[0])}});
    return IsUnsure("a loop that the MJCF closes is open");
  };
  EXPECT_TRUE(open(0.3)) << text_;
  EXPECT_FALSE(open(0)) << text_;
}

TEST_F(DraftTest, TorquesAreCommandsOfTorqueDrives) {
  std::vector<Named> columns = {{"time", motions_[0].time_s}};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string end = std::to_string(i + 1);
    columns.push_back({"tau_con" + end, motions_[i].torque});
    columns.push_back({"tau_meas" + end, Times(motions_[i].torque, 0.9)});
    columns.push_back({"pos_meas" + end, motions_[i].angle});
  }
  Experiment e = Drafted(Bars(kThree), columns);
  ASSERT_EQ(e.actuators.size(), 3u) << text_;
  EXPECT_EQ(e.actuators[1].kind, AddedActuator::Kind::kTorque);
  EXPECT_EQ(CommandOf(e, "knee"), "tau_con2");
  EXPECT_EQ(ColumnOf(e, "knee", SignalKind::kTorque), "tau_meas2");
  // The same of motors that the MJCF has, in an order of their own.
  const std::string motors =
      "<actuator><motor name=\"a\" joint=\"knee\"/><motor name=\"b\" joint=\"left foot\"/>"
      "<motor name=\"c\" joint=\"hip\"/></actuator>";
  e = Drafted(Bars(kThree, motors), columns);
  EXPECT_TRUE(e.actuators.empty());
  EXPECT_EQ(CommandOf(e, "a"), "tau_con2") << "as its joint's angle: " << text_;
  EXPECT_EQ(CommandOf(e, "c"), "tau_con1") << text_;
  EXPECT_EQ(ColumnOf(e, "hip"), "pos_meas1") << text_;
}

TEST_F(DraftTest, AFloatingBaseIsHeld) {
  const std::string robot =
      "<mujoco><worldbody><body name=\"trunk\"><freejoint/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/>"
      "<body><joint name=\"hip\" axis=\"0 0 1\"/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"0.02 0.02 0.02\"/>"
      "</body></body><body name=\"ball\" pos=\"3 0 0\"><freejoint/><geom size=\"0.1\"/></body></worldbody></mujoco>";
  const Experiment e = Drafted(robot, {{"time", motions_[0].time_s}, {"q", motions_[0].angle}});
  ASSERT_EQ(e.hold.size(), 1u) << text_;
  EXPECT_EQ(e.hold[0].name, "trunk") << "the ball carries no joint";
  EXPECT_TRUE(IsUnsure("held")) << text_;
}

TEST_F(DraftTest, WhatCannotBeDraftedIsAnError) {
  const auto says = [&](const Result<Draft>& draft, const std::string& text) {
    ASSERT_FALSE(draft.ok());
    EXPECT_NE(draft.error().Text().find(text), std::string::npos) << draft.error().Text();
  };
  const std::vector<Named> columns = Columns("u", "q", "", {"1", "2", "3"});
  says(TryDraft("<mujoco><worldbody><geom size=\"1\"/></worldbody></mujoco>", columns), "no hinge or slide joint that");
  says(TryDraft(Bars({"", "", ""}), columns), "no hinge or slide joint of the model has a name; name them");
  const std::string nameless = "<actuator><motor joint=\"hip\"/><motor joint=\"knee\"/></actuator>";
  says(TryDraft(Bars(kThree, nameless), columns),
       "an actuator of the model has no name: got actuator 0, on joint 'hip'");
  says(TryDraft(Bars(kThree), {{"time", motions_[0].time_s}, {"temp1", motions_[0].angle}}), "no column of the log");
  says(TryDraft(Bars(kThree), {{"time", motions_[0].time_s}, {"q1", std::vector<double>(2500, 1.0)}}),
       "no column of the log");
  says(TryDraft("<mujoco>", Columns("", "q", "", {"1", "2", "3"})), "cannot read the MJCF");
}

}  // namespace
}  // namespace gapscope::testing
