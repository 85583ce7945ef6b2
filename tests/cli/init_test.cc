// `gapscope init` on a robot of one's own: what it pairs, what it doubts, and that the draft replays.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cmath>
#include <filesystem>

#include "src/experiment/experiment.h"
#include "tests/experiment/scratch.h"

namespace gapscope::testing {
namespace {

constexpr const char* kArm = R"(<mujoco model="two_link">
  <compiler angle="radian"/>
  <option timestep="0.002" integrator="implicitfast" gravity="0 0 0"><flag contact="disable"/></option>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" axis="0 0 1" damping="0.4"/>
      <inertial pos="0.15 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
      <body name="fore" pos="0.3 0 0">
        <joint name="elbow" axis="0 0 1" damping="0.2" armature="0.01"/>
        <inertial pos="0.1 0 0" mass="0.5" diaginertia="0.004 0.004 0.004"/>
        <body name="hand" pos="0.2 0 0"><joint name="wrist" type="slide" axis="1 0 0" damping="5" stiffness="100"/>
          <inertial pos="0 0 0" mass="0.1" diaginertia="1e-4 1e-4 1e-4"/></body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="shoulder_servo" joint="shoulder" kp="40" kv="2"/>
    <motor name="elbow_motor" joint="elbow" gear="2"/>
    <velocity name="wrist_drive" joint="wrist" kv="8"/>
    <general name="trim" joint="elbow" gainprm="0.3" biastype="affine" biasprm="0 0 -0.1"/>
  </actuator>
</mujoco>)";

class InitTest : public ::testing::Test {
 protected:
  Answer Run(const std::string& arguments) const {
    return scratch_.Shell("cd '" + scratch_.Path("") + "' && '" GAPSCOPE_PROGRAM "' " + arguments);
  }
  // Shoulder follows its target late, elbow and wrist swing on their own; `names` are the columns' in this order:
  // time [ms], shoulder angle, elbow angle, wrist travel, shoulder target, elbow torque command, elbow speed.
  std::string Log(const std::vector<std::string>& names, const std::string& file = "log.csv") {
    std::string text;
    for (const auto& name : names) text += (text.empty() ? "" : ",") + name;
    text += "\n";
    for (int k = 0; k < 500; ++k) {
      const double t = 0.004 * k, target = 0.5 * std::sin(3 * t) + 0.2 * std::sin(7.3 * t),
                   elbow = 0.8 * std::sin(5 * t + 0.4), speed = 4 * std::cos(5 * t + 0.4);
      const double late = t > 0.05 ? 0.5 * std::sin(3 * (t - 0.05)) + 0.2 * std::sin(7.3 * (t - 0.05)) : 0;
      for (const double y : {1000 * t, late, elbow, 0.02 * std::sin(11 * t), target, 0.3 * std::cos(2 * t), speed})
        text += std::to_string(y) + ",";
      text.back() = '\n';
    }
    return scratch_.Write(file, text);
  }
  Experiment Drafted(const std::string& arguments) {
    const Answer answer = Run(arguments + " --out drafted/robot.yaml");
    EXPECT_EQ(answer.status, 0) << answer.err;
    err_ = answer.err;
    const auto loaded = LoadExperiment(scratch_.Path("drafted/robot.yaml"));
    EXPECT_TRUE(loaded.ok()) << loaded.error().Text() << "\n" << ReadAll(scratch_.Path("drafted/robot.yaml"));
    return loaded.ok() ? loaded.value() : Experiment{};
  }
  static const MeasuredSpec* Position(const Experiment& e, const std::string& joint) {
    for (const auto& m : e.measured) {
      if (m.on == joint && m.kind == SignalKind::kPosition) return &m;
    }
    return nullptr;
  }
  static const CommandSpec* Command(const Experiment& e, const std::string& actuator) {
    for (const auto& c : e.commands) {
      if (c.actuator == actuator) return &c;
    }
    return nullptr;
  }
  Scratch scratch_;
  std::string err_;
};

TEST_F(InitTest, PairsByNameAndTheDraftReplays) {
  scratch_.Write("arm.xml", kArm);
  Log({"time_ms", "shoulder_pos_rad", "elbow_pos_rad", "wrist_pos", "shoulder_target_rad", "elbow_torque_cmd",
       "elbow_vel_rad"});
  const Experiment e = Drafted("init arm.xml log.csv");
  EXPECT_EQ(e.model_path, scratch_.Path("arm.xml"));
  EXPECT_EQ(e.timeline.time_column, "time_ms");
  EXPECT_EQ(e.timeline.time_unit, "ms");
  for (const auto& [joint, column] :
       {std::pair{"shoulder", "shoulder_pos_rad"}, {"elbow", "elbow_pos_rad"}, {"wrist", "wrist_pos"}}) {
    const MeasuredSpec* measured = Position(e, joint);
    ASSERT_NE(measured, nullptr) << joint;
    EXPECT_EQ(measured->columns.front(), column);
  }
  ASSERT_NE(Command(e, "shoulder_servo"), nullptr);
  EXPECT_EQ(Command(e, "shoulder_servo")->columns.front(), "shoulder_target_rad");
  ASSERT_NE(Command(e, "elbow_motor"), nullptr);
  ASSERT_FALSE(Command(e, "elbow_motor")->columns.empty());
  EXPECT_EQ(Command(e, "elbow_motor")->columns.front(), "elbow_torque_cmd");
  // What has no column gets none, and says so.
  ASSERT_NE(Command(e, "wrist_drive"), nullptr);
  EXPECT_TRUE(Command(e, "wrist_drive")->columns.empty());
  EXPECT_NE(err_.find("wrist_drive"), std::string::npos) << err_;
  bool speed = false;
  for (const auto& m : e.measured)
    speed = speed || (m.kind == SignalKind::kVelocity && m.on == "elbow" && m.columns.front() == "elbow_vel_rad");
  EXPECT_TRUE(speed);
  // Parameters start at the MJCF's own values, within their bounds.
  for (const auto& p : e.parameters) {
    EXPECT_LE(p.low, p.nominal) << p.name;
    EXPECT_LT(p.low, p.high) << p.name;
    EXPECT_TRUE(p.name != "shoulder_servo.kp" || p.nominal == 40);
    EXPECT_TRUE(p.name != "shoulder.damping" || p.nominal == 0.4);
  }
  EXPECT_FALSE(e.parameters.empty());
  const Answer replay = Run("replay drafted/robot.yaml log.csv --quiet --time-step 0.002");
  EXPECT_EQ(replay.status, 0) << replay.err;
  EXPECT_NE(replay.out.find("elbow"), std::string::npos);
}

TEST_F(InitTest, PairsTheServosCommandByCorrelation) {
  scratch_.Write("arm.xml", kArm);
  Log({"t", "shoulder", "elbow", "wrist", "cmd_a", "cmd_b", "w_1"});
  const Experiment e = Drafted("init arm.xml log.csv");
  ASSERT_NE(Command(e, "shoulder_servo"), nullptr);
  ASSERT_FALSE(Command(e, "shoulder_servo")->columns.empty());
  EXPECT_EQ(Command(e, "shoulder_servo")->columns.front(), "cmd_a") << "the column that the shoulder follows";
  ASSERT_FALSE(Command(e, "elbow_motor")->columns.empty());
  EXPECT_EQ(Command(e, "elbow_motor")->columns.front(), "cmd_b");
  EXPECT_NE(ReadAll(scratch_.Path("drafted/robot.yaml")).find("# unsure: "), std::string::npos);
  EXPECT_NE(err_.find("unsure: "), std::string::npos);
  for (const auto& m : e.measured) {
    EXPECT_TRUE(m.columns.front() != "w_1" || m.on == "elbow") << "it follows the elbow's derivative";
  }
}

TEST_F(InitTest, StdoutHoldsTheDraftAlone) {
  scratch_.Write("arm.xml", kArm);
  Log({"t", "shoulder", "elbow", "wrist", "cmd_a", "cmd_b", "w_1"});
  const Answer answer = Run("init arm.xml log.csv --quiet");
  ASSERT_EQ(answer.status, 0) << answer.err;
  EXPECT_EQ(answer.err, "");
  const auto loaded = LoadExperiment(scratch_.Write("from_stdout.yaml", answer.out));
  EXPECT_TRUE(loaded.ok()) << loaded.error().Text();
}

TEST_F(InitTest, NamesThatYamlAndExpressionsDislike) {
  std::string robot = kArm;
  for (const auto& [from, to] : {std::pair{"shoulder_servo", "servo: #1"},
                                 {"name=\"elbow\"", "name=\"joint 2\""},
                                 {"joint=\"elbow\"", "joint=\"joint 2\""},
                                 {"joint=\"elbow\"", "joint=\"joint 2\""}})
    robot = Replaced(robot, from, to);
  scratch_.Write("arm.xml", robot);
  Log({"t", "shoulder", "joint 2", "wrist", "\"servo: #1 cmd\"", "cmd_b", "w_1"});
  const Experiment e = Drafted("init arm.xml log.csv");
  EXPECT_NE(Position(e, "joint 2"), nullptr);
  EXPECT_NE(Command(e, "servo: #1"), nullptr);
  EXPECT_EQ(Run("replay drafted/robot.yaml log.csv --quiet --time-step 0.002").status, 0)
      << ReadAll(scratch_.Path("stderr"));
}

// Bodies alone, with a floating base and a blank in a joint's name; columns by number.
constexpr const char* kBare = R"(<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.002" integrator="implicitfast" gravity="0 0 0"><flag contact="disable"/></option>
  <worldbody><body name="pelvis" pos="0 0 1"><freejoint/>
    <inertial pos="0 0 0" mass="5" diaginertia="0.1 0.1 0.1"/>
    <body name="upper"><joint name="left hip" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.02 0.02 0.02"/></body>
    <body name="other"><joint name="right hip" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.02 0.02 0.02"/></body>
  </body></worldbody></mujoco>)";

TEST_F(InitTest, ARobotOfBodiesAloneReplaysAndTunesAtOnce) {
  scratch_.Write("bare.xml", kBare);
  std::string text = "t_us,q_des[0],q_des[1],q[0],q[1]\n";
  for (int k = 0; k < 500; ++k) {
    // 0.02 q'' = 4 (u - q) - 0.4 q' of a slow target: q is u later by 0.1 s.
    const double t = 0.004 * k;
    for (const double y : {1e6 * t, 0.4 * std::sin(2 * t), 0.3 * std::sin(3 * t), 0.4 * std::sin(2 * (t - 0.1)),
                           0.3 * std::sin(3 * (t - 0.1))})
      text += std::to_string(y) + ",";
    text.back() = '\n';
  }
  scratch_.Write("log.csv", text);
  const Experiment e = Drafted("init bare.xml log.csv --servo kp=4,kd=0.4,limit=5");
  ASSERT_EQ(e.actuators.size(), 2u);
  EXPECT_EQ(e.actuators[0].joint, "left hip");
  EXPECT_EQ(e.actuators[0].kp, 4);
  ASSERT_EQ(e.hold.size(), 1u);
  EXPECT_EQ(e.hold[0].name, "pelvis");
  EXPECT_EQ(e.timeline.time_unit, "us");
  const Answer replay = Run("replay drafted/robot.yaml log.csv --quiet --time-step 0.002");
  EXPECT_EQ(replay.status, 0) << replay.err;
  EXPECT_NE(replay.out.find("left hip"), std::string::npos) << replay.out;
  const Answer tune = Run("tune drafted/robot.yaml log.csv --quiet --budget 2 --with \"command_delay@left hip\"");
  EXPECT_EQ(tune.status, 0) << tune.err;
  EXPECT_NE(tune.out.find("left_hip.kp"), std::string::npos) << tune.out;
}

TEST_F(InitTest, WhatDoesNotReplayIsNotWritten) {
  scratch_.Write("bare.xml", kBare);
  std::string text = "t,q_des[0],q_des[1],q[0],q[1]\n";
  for (int k = 0; k < 300; ++k) {
    const double t = 0.004 * k;
    for (const double y : {t, std::sin(20 * t), std::sin(30 * t), std::sin(20 * t - 1), std::sin(30 * t - 1)})
      text += std::to_string(y) + ",";
    text.back() = '\n';
  }
  scratch_.Write("log.csv", text);
  const Answer answer = Run("init bare.xml log.csv --servo kp=1e12,kd=0,armature=1e-6 --out drafted/robot.yaml");
  EXPECT_EQ(answer.status, 2) << answer.err;
  EXPECT_NE(answer.err.find("the draft does not replay"), std::string::npos) << answer.err;
  EXPECT_NE(answer.err.find("diverges"), std::string::npos) << answer.err;
  EXPECT_FALSE(std::filesystem::exists(scratch_.Path("drafted/robot.yaml")));
  for (const char* servo :
       {"kp=1", "kd=1", "kp=0,kd=1", "kp=1,kd=-1", "kp=1,kd=1,limit=0", "kp=1,kd=1,mass=2", "1,2", "kp=x,kd=1"}) {
    const Answer wrong = Run(std::string("init bare.xml log.csv --servo ") + servo);
    EXPECT_EQ(wrong.status, 2) << servo;
    EXPECT_NE(wrong.err.find("--servo"), std::string::npos) << servo << ": " << wrong.err;
    EXPECT_EQ(wrong.out, "") << servo;
  }
}

TEST_F(InitTest, WhatCannotBeDraftedIsRefused) {
  scratch_.Write("arm.xml", kArm);
  Log({"t", "shoulder", "elbow", "wrist", "cmd_a", "cmd_b", "w_1"});
  const auto refused = [&](const std::string& arguments, const std::string& says) {
    const Answer answer = Run(arguments);
    EXPECT_EQ(answer.status, 2) << arguments;
    EXPECT_NE(answer.err.find(says), std::string::npos) << arguments << ": " << answer.err;
    EXPECT_EQ(answer.out, "");
  };
  refused("init none.xml log.csv", "none.xml");
  refused("init arm.xml none.csv", "none.csv");
  refused("init log.csv log.csv", "log.csv");
  refused("init arm.xml", "logs");
  refused("init arm.xml log.csv --servo kp=1,kd=1", "the MJCF has its own");
  scratch_.Write("still.xml", "<mujoco><worldbody><geom size=\"1\"/></worldbody></mujoco>");
  refused("init still.xml log.csv", "joint");
  scratch_.Write("constant.csv", "t,shoulder\n0,1\n1,1\n2,1\n");
  refused("init arm.xml constant.csv", "no column of the log pairs");
  refused("init arm.xml log.csv --out /proc/none/robot.yaml", "/proc/none");
}

}  // namespace
}  // namespace gapscope::testing
