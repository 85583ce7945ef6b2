// A result carried into an MJCF as people write them: what changes, what stays, and what is refused.
#include "src/model/apply.h"

#include <gtest/gtest.h>

#include <sstream>

#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

constexpr char kAppliedRobot[] = R"(<?xml version='1.0'?>
<!-- A robot. <joint name="arm" damping="9"/> -->
<mujoco model='robot'>
  <compiler autolimits='true'/>   <!-- degrees, as MuJoCo has it -->
  <default>
    <joint armature="0.01"/>
    <default class="stiff"><joint damping="0.3" frictionloss="0"/></default>
  </default>
  <worldbody>
    <body name="arm"><joint name='arm' class="stiff"   axis="0 0 1"/>
      <geom type="box" size="0.1 0.02 0.02" pos="0.1 0 0" mass="1"/>
      <body name="tip" pos="0.2 0 0">
        <joint name="tip" axis="0 1 0" range="-90 90"/>
        <geom size="0.03" mass="0.2"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="arm" joint="arm" kp="20" kv="1"/>
  </actuator>
</mujoco>
)";
constexpr char kExperiment[] = R"(
commands: [{actuator: arm, column: u, unit: rad}]
measured: [{signal: q, column: q, joint: arm, unit: rad}, {signal: tip, column: tip, joint: tip, unit: rad}]
parameters:
  arm.damping: {unit: N m s/rad, nominal: 0.3, bounds: [0, 1]}
  arm.kp: {unit: N m/rad, nominal: 20, bounds: [1, 50]}
  tip.mass: {unit: kg, nominal: 0.2, bounds: [0.1, 1]}
set: {joint/arm/damping: arm.damping, actuator/arm/kp: arm.kp, body/tip/mass: tip.mass}
)";

// The lines that a change takes out, with "-", and brings in, with "+".
std::string ChangedLines(const std::string& before, const std::string& after) {
  const Scratch scratch;
  return scratch
      .Shell("diff '" + scratch.Write("a", before) + "' '" + scratch.Write("b", after) +
             "' | sed -n 's/^< /-/p; s/^> /+/p'")
      .out;
}

class ApplyTest : public ::testing::Test {
 protected:
  Result<AppliedMjcf> Apply(const std::string& mjcf, const std::vector<std::string>& effects,
                            const std::map<std::string, double>& set,
                            const std::map<std::string, std::string>& notes = {}, const std::string& out = "out.xml") {
    const Experiment experiment = MakeExperiment(scratch_, mjcf, experiment_);
    const auto base = MakeModel(experiment);
    const auto model = MakeModel(experiment, ParseEffects(effects, *base->rig()).value());
    return ApplyToMjcf(*model, ValuesWith(*model, set), {.out = scratch_.Path(out), .notes = notes});
  }
  void ExpectRefused(const std::string& mjcf, const std::map<std::string, double>& set, const std::string& says) {
    const auto applied = Apply(mjcf, {}, set);
    ASSERT_FALSE(applied.ok());
    EXPECT_NE(applied.error().Text().find(says), std::string::npos) << applied.error().Text();
    EXPECT_FALSE(applied.error().cure.empty());
  }
  Scratch scratch_;
  std::string experiment_ = kExperiment;
};

std::string With(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

TEST_F(ApplyTest, NothingToSayLeavesEveryByte) {
  const auto applied = Apply(kAppliedRobot, {}, {});
  ASSERT_TRUE(applied.ok()) << applied.error().Text();
  EXPECT_EQ(applied.value().text, kAppliedRobot);
  EXPECT_TRUE(applied.value().changes.empty());
}

TEST_F(ApplyTest, ValuesGoToTheElementItselfWhereAClassHadThem) {
  const auto applied = Apply(kAppliedRobot, {}, {{"arm.damping", 0.25}, {"arm.kp", 21}, {"tip.mass", 0.3}},
                             {{"arm.damping", "less damping"}, {"arm.kp", "stiffer"}, {"tip.mass", "heavier"}});
  ASSERT_TRUE(applied.ok()) << applied.error().Text();
  EXPECT_EQ(ChangedLines(kAppliedRobot, applied.value().text),
            R"(-    <body name="arm"><joint name='arm' class="stiff"   axis="0 0 1"/>
+    <body name="arm"><!-- gapscope: less damping --> <joint name='arm' class="stiff"   axis="0 0 1" damping="0.25"/>
+        <!-- gapscope: heavier -->
+        <inertial pos="0 0 0" mass="0.3" diaginertia="7.2e-05 7.2e-05 7.2e-05"/>
-    <position name="arm" joint="arm" kp="20" kv="1"/>
+    <!-- gapscope: stiffer -->
+    <position name="arm" joint="arm" kp="21" kv="1"/>
)");
}

TEST_F(ApplyTest, AnglesAreWrittenInTheFilesUnit) {
  const auto applied =
      Apply(kAppliedRobot, {"cable_spring@arm"},
            {{"cable_spring@arm.stiffness_n_m_per_rad", 2}, {"cable_spring@arm.rest_rad", 0.5235987756}});
  ASSERT_TRUE(applied.ok()) << applied.error().Text();
  EXPECT_NE(applied.value().text.find("springref=\"30\""), std::string::npos) << applied.value().text;
}

TEST_F(ApplyTest, EffectsThatMujocoLacksBecomePluginElements) {
  const auto applied = Apply(kAppliedRobot, {"torque_limit@arm", "backlash@arm"},
                             {{"torque_limit@arm.limit_n_m", 3}, {"backlash@arm.gap_rad", 0.02}},
                             {{"torque_limit@arm.limit_n_m", "it saturates"}, {"backlash@arm.motor_share", "a gap"}});
  ASSERT_TRUE(applied.ok()) << applied.error().Text();
  const std::string& text = applied.value().text;
  for (const char* part :
       {"<extension>\n    <!-- gapscope: it saturates -->\n    <plugin plugin=\"gapscope.motor\">",
        "<!-- gapscope: it saturates -->\n    <!-- gapscope: a gap -->\n    <plugin name=\"arm\" joint=\"arm.motor\"",
        "<numeric name=\"arm.torque_limit_n_m\" size=\"1\" data=\"3\"/>", "<body name=\"arm.motor\">", "<tendon>"})
    EXPECT_NE(text.find(part), std::string::npos) << text << "\nlacks: " << part;
}

TEST_F(ApplyTest, WhatAnIncludedFileHoldsTakesItsPlace) {
  // The main file includes one that holds the robot, which includes one that stays.
  std::string robot = With(kAppliedRobot, "  <worldbody>", "  <include file='scene.xml'/>\n  <worldbody>");
  robot = With(robot, "<?xml version='1.0'?>\n", "");
  scratch_.Write("parts/scene.xml", "<mujoco><statistic extent='2'/></mujoco>");
  scratch_.Write("parts/robot.xml", robot);
  const std::string main = "<mujoco>\n  <include file='parts/robot.xml'/>\n</mujoco>\n";
  const auto untouched = Apply(main, {}, {});
  ASSERT_TRUE(untouched.ok()) << untouched.error().Text();
  EXPECT_EQ(untouched.value().text, main);
  const auto applied = Apply(main, {}, {{"arm.damping", 0.25}}, {}, "elsewhere/out.xml");
  ASSERT_TRUE(applied.ok()) << applied.error().Text();
  EXPECT_EQ(applied.value().text.find("parts/robot.xml'"), std::string::npos) << applied.value().text;
  EXPECT_NE(applied.value().text.find("<include file='../parts/scene.xml'/>"), std::string::npos)
      << applied.value().text;
  EXPECT_NE(applied.value().text.find("axis=\"0 0 1\" damping=\"0.25\""), std::string::npos) << applied.value().text;
}

TEST_F(ApplyTest, WhatStandsInAFrameIsChangedThere) {
  const std::string framed =
      With(With(kAppliedRobot, "<body name=\"arm\">", "<frame pos=\"0 0 0.1\" euler=\"0 0 90\"><body name=\"arm\">"),
           "  </worldbody>", "  </frame></worldbody>");
  const auto applied = Apply(framed, {}, {{"arm.damping", 0.25}}, {{"arm.damping", "less damping"}});
  ASSERT_TRUE(applied.ok()) << applied.error().Text();
  EXPECT_EQ(With(applied.value().text, "<!-- gapscope: less damping --> ", ""),
            With(framed, "axis=\"0 0 1\"", "axis=\"0 0 1\" damping=\"0.25\""));
}

TEST_F(ApplyTest, WhatTextCannotFollowIsRefused) {
  // The masses are those of the geoms, whatever <inertial> says.
  ExpectRefused(With(kAppliedRobot, "autolimits='true'", "inertiafromgeom='true'"), {{"tip.mass", 0.3}},
                "another model");
  // Elements that no text has, as MuJoCo makes them.
  const std::string tip = "<body name=\"tip\" pos=\"0.2 0 0\">";
  const std::size_t begin = std::string(kAppliedRobot).find(tip),
                    end = std::string(kAppliedRobot).find("    </body>\n  </world");
  scratch_.Write("hand.xml", "<mujoco model=\"hand\"><worldbody>" +
                                 std::string(kAppliedRobot).substr(begin, end - begin) + "</worldbody></mujoco>");
  std::string attached = kAppliedRobot;
  attached.replace(begin, end - begin, "<attach model=\"hand\" body=\"tip\" prefix=\"\"/>\n");
  attached =
      With(attached, "  <worldbody>", "  <asset><model name=\"hand\" file=\"hand.xml\"/></asset>\n  <worldbody>");
  ExpectRefused(attached, {{"tip.mass", 0.3}}, "the MJCF's text has no");
  const std::string copied = With(With(kAppliedRobot, tip, "<replicate count=\"1\" sep=\"\">" + tip),
                                  "      </body>\n    </body>", "      </body></replicate>\n    </body>");
  experiment_ = With(With(experiment_, "joint: tip,", "joint: tip0,"), "body/tip/", "body/tip0/");
  ExpectRefused(copied, {{"tip.mass", 0.3}}, "the MJCF's text has no");
}

}  // namespace
}  // namespace gapscope::testing
