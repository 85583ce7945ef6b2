// What a rig says of itself, and what terms of effects become in its MJCF.
#include "src/model/rig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "src/model/structure.h"
#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

constexpr const char* kMjcf = R"(<mujoco>
  <compiler angle="radian"/>
  <extension>
    <plugin plugin="gapscope.motor">
      <instance name="duty"><config key="law" value="duty"/><config key="duty_gain" value="2"/>
        <config key="kt" value="1"/>
        <config key="ke" value="1"/><config key="resistance" value="1"/><config key="supply_v" value="5"/></instance>
      <instance name="slack"><config key="kp" value="0"/></instance>
      <instance name="torque"><config key="law" value="torque"/><config key="inputs" value="torque enable"/></instance>
    </plugin>
  </extension>
  <worldbody>
    <body name="a"><joint name="sprung" axis="0 0 1" stiffness="0.3"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.02"/></body>
    <body name="b"><joint name="rough" axis="0 0 1" frictionloss="0.1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.02"/></body>
    <body name="c"><joint name="slide" type="slide"/><inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.02"/>
      </body>
    <body name="d"><joint name="ball" type="ball"/><inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.02"/></body>
    <body name="e"><joint name="free_one" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.02"/>
      </body>
  </worldbody>
  <actuator>
    <position name="servo" joint="sprung" kp="2"/>
    <motor name="servo.feedforward" joint="sprung"/>
    <plugin name="duty" joint="rough" plugin="gapscope.motor" instance="duty"/>
    <plugin name="slack" joint="slide" plugin="gapscope.motor" instance="slack"/>
    <plugin name="torque" joint="free_one" plugin="gapscope.motor" instance="torque"/>
    <plugin name="switch" joint="free_one" plugin="gapscope.motor" instance="torque"/>
  </actuator>
</mujoco>)";
constexpr const char* kRigYaml = R"(commands:
  - {actuator: servo, column: u, unit: deg}
  - {actuator: servo.feedforward, column: f, unit: N m}
  - {actuator: duty, column: v, unit: mV}
  - {actuator: slack, column: w}
measured:
  - {signal: angle, column: q, joint: sprung, unit: rad}
  - {signal: torque, column: t, kind: torque, actuator: duty}
parameters:
  rough.friction: {unit: N m, nominal: 0.2, frozen: true}
set:
  joint/rough/frictionloss: rough.friction
)";

class RigTest : public ::testing::Test {
 protected:
  RigTest() : rig_(Rig::Load(MakeExperiment(scratch_, kMjcf, kRigYaml)).value()) {}
  // The expression that a field of the finished structure is set to; empty: none.
  static std::string SetTo(const Structure& structure, const std::string& field) {
    for (const auto& setting : structure.settings) {
      if (setting.field == field) return setting.expressions.front();
    }
    return "";
  }
  Scratch scratch_;
  std::shared_ptr<const Rig> rig_;
};

TEST_F(RigTest, NamesWhatEffectsCanActOn) {
  EXPECT_EQ(rig_->Joints(), (std::vector<std::string>{"sprung", "rough", "slide", "free_one"}));  // no ball
  EXPECT_EQ(rig_->Actuators(), (std::vector<std::string>{"servo", "duty", "slack", "torque"}));   // no second input
  EXPECT_EQ(rig_->JointOf("servo.feedforward"), "sprung");
  EXPECT_EQ(rig_->JointOf("nobody"), "");
  EXPECT_EQ(rig_->ActuatorOf("sprung"), "servo");
  EXPECT_EQ(rig_->ActuatorOf("ball"), "");
  EXPECT_EQ(rig_->Signals(), (std::vector<std::string>{"angle", "torque"}));
  EXPECT_EQ(rig_->JointOfSignal("angle"), "sprung");
  EXPECT_EQ(rig_->JointOfSignal("torque"), "rough");
  EXPECT_EQ(rig_->JointOfSignal("noise"), "");
}

TEST_F(RigTest, KnowsSpringsFrictionDrivesAndCommands) {
  EXPECT_TRUE(rig_->HasSpring("sprung"));
  EXPECT_FALSE(rig_->HasSpring("rough"));
  EXPECT_TRUE(rig_->HasFriction("rough"));
  EXPECT_FALSE(rig_->HasFriction("sprung"));
  struct Case {
    const char* actuator;
    bool feeds_back, holds, enables;
  };
  for (const auto& [actuator, feeds_back, holds, enables] :
       {Case{"servo", true, true, false}, Case{"duty", true, true, false}, Case{"slack", true, false, false},
        Case{"torque", false, false, false}, Case{"switch", false, false, true},
        Case{"servo.feedforward", false, false, false}, Case{"none", false, false, false}}) {
    EXPECT_EQ(rig_->FactsOf(actuator).feeds_back_position, feeds_back) << actuator;
    EXPECT_EQ(rig_->FactsOf(actuator).holds_position, holds) << actuator;
    EXPECT_EQ(rig_->FactsOf(actuator).enables, enables) << actuator;
  }
  EXPECT_EQ(rig_->KindOfCommand("servo"), CommandKind::kAngle);
  EXPECT_EQ(rig_->KindOfCommand("servo.feedforward"), CommandKind::kTorque);
  EXPECT_EQ(rig_->KindOfCommand("duty"), CommandKind::kVoltage);
  EXPECT_EQ(rig_->KindOfCommand("slack"), CommandKind::kOther);
}

TEST_F(RigTest, ASecondTermJoinsTheFirstAsItsParameterSays) {
  Structure structure(*rig_);
  ASSERT_TRUE(structure.AddMotorTerm("servo", "torque_limit_n_m", "3").ok());
  ASSERT_TRUE(structure.AddMotorTerm("servo", "torque_limit_n_m", "2").ok());
  ASSERT_TRUE(structure.AddMotorTerm("servo", "dead_zone", "0.1").ok());
  ASSERT_TRUE(structure.AddMotorTerm("servo", "dead_zone", "0.2").ok());
  ASSERT_TRUE(structure.AddMotorTerm("servo", "time_constant_s", "0.01").ok());
  ASSERT_TRUE(structure.Finish().ok());
  EXPECT_EQ(SetTo(structure, "numeric/servo.torque_limit_n_m"), "min(3,2)");
  EXPECT_EQ(SetTo(structure, "numeric/servo.dead_zone"), "0.1+(0.2)");
  const ModelPtr model(mj_compile(structure.spec.get(), nullptr));
  ASSERT_TRUE(model) << mjs_getError(structure.spec.get());
  EXPECT_EQ(model->na, 1) << "the lag's activation";
  EXPECT_EQ(rig_->compiled().na, 0) << "the rig itself stays as it was";
}

TEST_F(RigTest, FrictionIsTheJointsOwnUntilMoreIsAskedFor) {
  Structure plain(*rig_);
  ASSERT_TRUE(plain.AddFrictionTerm("rough", "friction_n_m", "0.5").ok());
  ASSERT_TRUE(plain.Finish().ok());
  EXPECT_NE(SetTo(plain, "joint/rough/frictionloss").find("rough.friction+0.5"), std::string::npos);
  EXPECT_EQ(SetTo(plain, "numeric/rough.friction.friction_n_m"), "");
  Structure loaded(*rig_);
  ASSERT_TRUE(loaded.AddFrictionTerm("rough", "load_coefficient", "0.5").ok());
  ASSERT_TRUE(loaded.Finish().ok());
  EXPECT_EQ(SetTo(loaded, "numeric/rough.friction.friction_n_m"), "rough.friction");
  EXPECT_EQ(SetTo(loaded, "numeric/rough.friction.load_coefficient"), "0.5");
  const ModelPtr model(mj_compile(loaded.spec.get(), nullptr));
  ASSERT_TRUE(model) << mjs_getError(loaded.spec.get());
  EXPECT_GE(mj_name2id(model.get(), mjOBJ_ACTUATOR, "rough.friction"), 0) << "its turn after the drive";
}

TEST_F(RigTest, ASpringIsTheJointsOwnWhereItHasNone) {
  Structure structure(*rig_);
  ASSERT_TRUE(structure.AddSpringTerm("rough", "stiffness_n_m_per_rad", "4").ok());
  ASSERT_TRUE(structure.AddSpringTerm("rough", "rest_rad", "0.1").ok());
  ASSERT_TRUE(structure.AddSpringTerm("rough", "cubic_n_m_per_rad3", "5").ok());
  ASSERT_TRUE(structure.AddSpringTerm("rough", "bias_n_m", "6").ok());
  ASSERT_TRUE(structure.AddSpringTerm("sprung", "stiffness_n_m_per_rad", "4").ok());
  ASSERT_TRUE(structure.AddSpringTerm("sprung", "rest_rad", "0.1").ok());
  ASSERT_TRUE(structure.Finish().ok());
  EXPECT_EQ(SetTo(structure, "joint/rough/stiffness_cubic"), "5");
  EXPECT_EQ(SetTo(structure, "joint/rough/stiffness"), "4");
  EXPECT_EQ(SetTo(structure, "joint/rough/springref"), "0.1");
  EXPECT_EQ(SetTo(structure, "numeric/rough.spring.bias_n_m"), "6");
  EXPECT_EQ(SetTo(structure, "numeric/rough.spring.stiffness_n_m_per_rad"), "");
  EXPECT_EQ(SetTo(structure, "joint/sprung/stiffness"), "");
  EXPECT_EQ(SetTo(structure, "numeric/sprung.spring.stiffness_n_m_per_rad"), "4");
}

TEST_F(RigTest, OneRestAngleIsOneSpring) {
  Structure structure(*rig_);
  ASSERT_TRUE(structure.AddSpringTerm("sprung", "stiffness_n_m_per_rad", "4").ok());
  ASSERT_TRUE(structure.AddSpringTerm("sprung", "cubic_n_m_per_rad3", "5").ok());
  ASSERT_TRUE(structure.AddFrictionTerm("sprung", "quadratic_n_m_s2_per_rad2", "6").ok());
  ASSERT_TRUE(structure.Finish().ok());
  EXPECT_EQ(SetTo(structure, "joint/sprung/stiffness"), "0.29999999999999999+(4)");
  EXPECT_EQ(SetTo(structure, "joint/sprung/stiffness_cubic"), "5");
  EXPECT_EQ(SetTo(structure, "joint/sprung/damping_quadratic"), "6");
  EXPECT_EQ(SetTo(structure, "numeric/sprung.spring.stiffness_n_m_per_rad"), "");
  EXPECT_EQ(SetTo(structure, "numeric/sprung.friction.quadratic_n_m_s2_per_rad2"), "");
}

TEST_F(RigTest, TermsOnWhatIsNotThereNameTheNearest) {
  Structure structure(*rig_);
  const auto message = [](const Status& status) { return status.ok() ? "" : status.error().Text(); };
  EXPECT_NE(message(structure.AddFrictionTerm("rouhg", "friction_n_m", "1")).find("did you mean 'rough'?"),
            std::string::npos);
  EXPECT_NE(message(structure.AddSpringTerm("spring", "rest_rad", "1")).find("did you mean 'sprung'?"),
            std::string::npos);
  EXPECT_NE(message(structure.AddMotorTerm("sevro", "dead_zone", "1")).find("did you mean 'servo'?"),
            std::string::npos);
  ASSERT_TRUE(structure.AddSpringTerm("rough", "rest_rad", "1").ok());
  EXPECT_NE(message(structure.AddSpringTerm("rough", "rest_rad", "1")).find("two effects that set 'rest_rad'"),
            std::string::npos);
  EXPECT_THROW((void)structure.AddMotorTerm("servo", "torque_limit", "1"), std::logic_error)
      << "no parameter of the motor";
}

TEST_F(RigTest, MemoriesAreTheTimesThatADriveRemembers) {
  const auto model = Model::Build(rig_, {{"actuator_lag", "servo"}, {"supply_sag", "duty"}, {"torque_delay", "servo"}});
  ASSERT_TRUE(model.ok()) << model.error().Text();
  std::vector<std::string> names;
  for (const int i : model.value()->memories()) names.push_back(model.value()->parameters()[i].name);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"actuator_lag@servo.time_constant_s", "supply_sag@duty.time_constant_s"}));
}

// A copy of the MJCF finds the files beside it, whatever folder the program runs in.
TEST(RigFilesTest, ACopyKeepsWhatIsDrawn) {
  const Scratch scratch;
  scratch.Write("tetra.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const auto model = MakeModel(MakeExperiment(scratch, R"(<mujoco>
    <asset><mesh name="tetra" file="tetra.obj"/></asset>
    <worldbody><body><joint name="hinge"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <geom type="mesh" mesh="tetra" contype="0" conaffinity="0"/></body></worldbody></mujoco>)",
                                              "measured:\n  - {signal: q, column: q, joint: hinge, unit: rad}\n"),
                               {{"torque_bias", "hinge"}});
  ASSERT_NE(model, nullptr);
  EXPECT_EQ(model->compiled().nmesh, 0) << "a replay draws nothing";
  for (int time = 0; time < 2; ++time) {
    const auto drawn = model->CompileForDrawing(model->Nominal(), {});
    ASSERT_TRUE(drawn.ok()) << drawn.error().Text();
    EXPECT_EQ(drawn.value()->nmesh, 1);
    EXPECT_EQ(drawn.value()->nmeshface, 4);
  }
}

}  // namespace
}  // namespace gapscope::testing
