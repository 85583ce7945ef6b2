// Actuators and a stand that the experiment file adds, beside the same written into the MJCF.
#include <gtest/gtest.h>

#include "src/model/apply.h"
#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

// A floating trunk with an arm of three joints; bodies alone. BASE, ACTUATORS, ARMATURE are filled in.
std::string Robot(const std::string& base, const std::string& actuators, const std::string& armature) {
  std::string text = R"(<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.001" integrator="implicitfast"><flag contact="disable"/></option>
  <worldbody>
    <body name="trunk" pos="0 0 1" quat="0.9 0.1 0 0">BASE
      <inertial pos="0 0 0" mass="3" diaginertia="0.03 0.03 0.03"/>
      <body name="upper"><joint name="shoulder" axis="0 1 0"ARMATURE/>
        <inertial pos="0 0 -0.1" mass="1" diaginertia="0.01 0.01 0.01"/>
        <body name="fore" pos="0 0 -0.2"><joint name="joint 2" axis="0 1 0" damping="0.05"/>
          <inertial pos="0 0 -0.1" mass="0.5" diaginertia="0.004 0.004 0.004"/>
          <body name="hand" pos="0 0 -0.2"><joint name="wrist" axis="0 0 1" damping="0.01"/>
            <inertial pos="0.05 0 0" mass="0.1" diaginertia="1e-4 1e-4 2e-4"/></body></body></body>
    </body>
  </worldbody>ACTUATORS
  KEY
</mujoco>)";
  text = Replaced(text, "BASE", base);
  text = Replaced(text, "ARMATURE", armature);
  text = Replaced(text, "ACTUATORS", actuators);
  return Replaced(text, "KEY", base.empty() ? "" : "<keyframe><key qpos=\"0 0 2 1 0 0 0 0 0 0\"/></keyframe>");
}

constexpr const char* kAdded = R"(actuators:
  - {name: shoulder, joint: shoulder, kind: position, kp: 30, kd: 2, force_limit_n_m: 4, armature_kg_m2: 0.05}
  - {name: elbow servo, joint: joint 2, kind: velocity, kd: 0.7}
  - {name: wrist, joint: wrist, kind: torque, force_limit_n_m: 0.01}
)";
constexpr const char* kBound = R"(commands:
  - {actuator: shoulder, column: a, unit: rad}
  - {actuator: elbow servo, column: b, unit: rad/s}
  - {actuator: wrist, column: c, unit: N m}
measured:
  - {signal: shoulder, column: a, joint: shoulder, unit: rad}
  - {signal: joint 2, column: b, joint: joint 2, unit: rad}
  - {signal: wrist, column: c, joint: wrist, unit: rad}
)";
const std::string kHold = "hold: [trunk]\n";
constexpr double kSame = 1e-12;

std::string NativeActuators(const std::string& kp) {
  return R"(<actuator>
    <position name="shoulder" joint="shoulder" kp=")" +
         kp + R"(" kv="2" forcerange="-4 4"/>
    <velocity name="elbow servo" joint="joint 2" kv="0.7"/>
    <motor name="wrist" joint="wrist" forcerange="-0.01 0.01"/></actuator>)";
}

double Command(int command, double t) {
  constexpr double kSize[] = {1.2, 3, 0.02};
  return Exciting(t, kSize[command]);
}

class AddedActuatorsTest : public ::testing::Test {
 protected:
  Experiment Load(const std::string& mjcf, const std::string& yaml) { return MakeExperiment(scratch_, mjcf, yaml); }
  std::vector<std::vector<double>> Run(const std::string& mjcf, const std::string& yaml,
                                       const std::map<std::string, double>& set = {},
                                       const std::vector<EffectUse>& effects = {}) {
    const Experiment e = Load(mjcf, yaml);
    const auto model = MakeModel(e, effects);
    if (!model) return {};
    return Predict(*model, MakeRecording(e, 500, 0.002, Command), set);
  }
  static void ExpectSame(const std::vector<std::vector<double>>& a, const std::vector<std::vector<double>>& b,
                         double tolerance = kSame) {
    ASSERT_EQ(a.size(), 3u);
    ASSERT_EQ(b.size(), 3u);
    for (std::size_t s = 0; s < 3; ++s) {
      EXPECT_GT(Largest(a[s]), 0.05) << "signal " << s << " moves";
      EXPECT_LE(LargestDifference(a[s], b[s]), tolerance) << "signal " << s;
    }
  }
  std::string Message(const std::string& yaml) {
    const std::string path = scratch_.Write("experiment.yaml", "model: robot.xml\n" + yaml);
    scratch_.Write("robot.xml", Robot("<freejoint/>", "", ""));
    const auto experiment = LoadExperiment(path);
    if (!experiment.ok()) return experiment.error().Text();
    const auto rig = Rig::Load(experiment.value());
    return rig.ok() ? "" : rig.error().Text();
  }
  Scratch scratch_;
};

TEST_F(AddedActuatorsTest, AreTheNativeOnes) {
  ExpectSame(Run(Robot("", "", ""), std::string(kAdded) + kBound),
             Run(Robot("", NativeActuators("30"), " armature=\"0.05\""), kBound));
}

TEST_F(AddedActuatorsTest, TheirNumbersAreParametersThatNobodyListed) {
  const Experiment e = Load(Robot("", "", ""), std::string(kAdded) + kBound);
  std::map<std::string, Parameter> found;
  for (const Parameter& p : e.parameters) found[p.name] = p;
  for (const auto& [name, value] : {std::pair{"shoulder.kp", 30.0},
                                    {"shoulder.kd", 2.0},
                                    {"shoulder.force_limit_n_m", 4.0},
                                    {"shoulder.armature_kg_m2", 0.05},
                                    {"elbow_servo.kd", 0.7},
                                    {"wrist.force_limit_n_m", 0.01}}) {
    ASSERT_TRUE(found.contains(name)) << name;
    EXPECT_EQ(found[name].nominal, value) << name;
    EXPECT_TRUE(found[name].frozen) << name;
    EXPECT_LT(found[name].low, value) << name;
    EXPECT_GT(found[name].high, value) << name;
  }
  EXPECT_EQ(found.size(), 6u);
  ExpectSame(Run(Robot("", "", ""), std::string(kAdded) + kBound, {{"shoulder.kp", 60}}),
             Run(Robot("", NativeActuators("60"), " armature=\"0.05\""), kBound));
}

TEST_F(AddedActuatorsTest, WhatTheExperimentSaysOfAParameterHolds) {
  const std::string listed =
      "parameters:\n  shoulder.kp: {unit: N m/rad, nominal: 25, bounds: [10, 40]}\n"
      "  k: {unit: N m s/rad, nominal: 3, frozen: true}\nset:\n  actuator/shoulder/kv: k\n";
  const Experiment e = Load(Robot("", "", ""), std::string(kAdded) + kBound + listed);
  int gains = 0;
  for (const Parameter& p : e.parameters) {
    if (p.name == "shoulder.kp") {
      ++gains;
      EXPECT_FALSE(p.frozen);
      EXPECT_EQ(p.nominal, 25);
      EXPECT_EQ(p.high, 40);
    }
    EXPECT_NE(p.name, "shoulder.kd") << "another parameter makes that field";
  }
  EXPECT_EQ(gains, 1);
  const std::string native = Replaced(NativeActuators("25"), "kv=\"2\"", "kv=\"3\"");
  ExpectSame(Run(Robot("", "", ""), std::string(kAdded) + kBound + listed),
             Run(Robot("", native, " armature=\"0.05\""), kBound));
}

TEST_F(AddedActuatorsTest, EffectsActOnThem) {
  const auto late = [&](const std::string& mjcf, const std::string& yaml) {
    const Experiment e = Load(mjcf, yaml);
    const auto model = MakeModel(e, {{.effect = "torque_delay", .on = "shoulder"}});
    if (!model) return std::vector<std::vector<double>>{};
    return Predict(*model, MakeRecording(e, 500, 0.002, Command), {{"torque_delay@shoulder.delay_s", 0.01}});
  };
  const auto added = late(Robot("", "", ""), std::string(kAdded) + kBound);
  ExpectSame(added, late(Robot("", NativeActuators("30"), " armature=\"0.05\""), kBound));
  const auto on_time = Run(Robot("", "", ""), std::string(kAdded) + kBound);
  ASSERT_FALSE(on_time.empty() || added.empty());
  EXPECT_GT(LargestDifference(added[0], on_time[0]), 1e-3);
}

TEST_F(AddedActuatorsTest, AHeldBodyStandsWhereTheMjcfPutsIt) {
  const auto standing = Run(Robot("", "", ""), std::string(kAdded) + kBound);
  ExpectSame(Run(Robot("<freejoint name=\"float\"/>", "", ""), kHold + kAdded + kBound), standing);
  ExpectSame(Run(Robot("<freejoint name=\"float\"/>", "", ""), "hold: [float]\n" + (std::string(kAdded) + kBound)),
             standing);
  const auto falling = Run(Robot("<freejoint/>", "", ""), std::string(kAdded) + kBound);
  ASSERT_FALSE(falling.empty());
  EXPECT_GT(LargestDifference(falling[0], standing[0]), 1e-3) << "without a stand it falls";
}

TEST_F(AddedActuatorsTest, ApplyWritesThemIntoTheMjcf) {
  const Experiment e = Load(Robot("", "", ""), std::string(kAdded) + kBound);
  const auto model = MakeModel(e);
  ASSERT_NE(model, nullptr);
  const std::string out = scratch_.Path("applied.xml");
  const auto applied = ApplyToMjcf(*model, model->Nominal(), {.out = out, .notes = {}});
  ASSERT_TRUE(applied.ok()) << applied.error().Text();
  ExpectSame(Run(applied.value().text, kBound), Run(Robot("", NativeActuators("30"), " armature=\"0.05\""), kBound));
}

TEST_F(AddedActuatorsTest, ApplyDoesNotTakeAFreeJointAway) {
  const Experiment e = Load(Robot("<freejoint/>", "", ""), kHold + kAdded + kBound);
  const auto model = MakeModel(e);
  ASSERT_NE(model, nullptr);
  const auto applied = ApplyToMjcf(*model, model->Nominal(), {.out = scratch_.Path("applied.xml"), .notes = {}});
  ASSERT_FALSE(applied.ok());
  EXPECT_NE(applied.error().Text().find("experiment.yaml:2:8: the experiment holds 'trunk'"), std::string::npos)
      << applied.error().Text();
}

TEST_F(AddedActuatorsTest, WhatDoesNotFitIsRefusedWithItsLine) {
  EXPECT_EQ(Message(kHold + kAdded + kBound), "");
  struct Case {
    const char *from, *to, *says;
  };
  // "model:" is line 1, "hold:" line 2, the actuators lines 4 to 6, the commands lines 8 to 10.
  const Case cases[] = {
      {"name: elbow servo", "name: shoulder", "experiment.yaml:5:5: the actuator 'shoulder' stands twice"},
      {"joint: joint 2, kind", "joint: joint 3, kind", "experiment.yaml:5:5: an actuator acts on a joint that the"},
      {"joint: joint 2, kind", "joint: joint 3, kind", "did you mean 'joint 2'?"},
      {"kp: 30", "kp: -30", "experiment.yaml:4:5: 'kp' of the actuator 'shoulder' is out of range"},
      {"kp: 30, ", "", "'kp'"},
      {"kd: 0.7", "kd: 0", "experiment.yaml:5:5: 'kd' of the actuator 'elbow servo' is out of range"},
      {"kd: 0.7", "kd: 0.7, kp: 3", "experiment.yaml:5:5: the actuator 'elbow servo' has a gain that its kind"},
      {"kind: torque", "kind: force", "position, velocity, torque"},
      {"force_limit_n_m: 4", "force_limit: 4", "did you mean 'force_limit_n_m'?"},
      {"actuator: wrist", "actuator: rist", "experiment.yaml:10:5: a command drives an actuator that the MJCF lacks"},
      {"actuator: wrist", "actuator: rist", "did you mean 'wrist'?"},
      {"hold: [trunk]", "hold: [upper]", "experiment.yaml:2:8: the body 'upper' is held, but has no free joint"},
      {"hold: [trunk]", "hold: [trunc]", "experiment.yaml:2:8: a body is held that the MJCF lacks"},
      {"hold: [trunk]", "hold: [trunk, trunk]", "experiment.yaml:2:15: 'hold' names the body 'trunk' twice"},
      {"hold: [trunk]", "hold: trunk", "experiment.yaml:2:7: 'hold' is not a list of bodies"},
  };
  for (const auto& [from, to, says] : cases) {
    const std::string message = Message(Replaced(kHold + kAdded + kBound, from, to));
    EXPECT_NE(message.find(says), std::string::npos) << to << ": " << message;
  }
  const std::string native = Robot("", NativeActuators("30"), "");
  const auto twice = Rig::Load(Load(native, std::string(kAdded) + kBound));
  ASSERT_FALSE(twice.ok());
  EXPECT_NE(twice.error().Text().find("experiment.yaml:3:5: the MJCF has an actuator 'shoulder' already"),
            std::string::npos)
      << twice.error().Text();
}

}  // namespace
}  // namespace gapscope::testing
