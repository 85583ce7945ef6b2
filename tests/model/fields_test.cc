// Every kind of field: written into a compiled model it gives the motion that the same number in the MJCF gives.
#include "src/model/fields.h"

#include <gtest/gtest.h>

#include <cmath>

#include "src/core/mujoco_handles.h"
#include "tests/experiment/scratch.h"

namespace gapscope::testing {
namespace {

constexpr const char* kRobot = R"(<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.002" integrator="RK4" gravity="0 0 -9.81"><flag contact="disable"/></option>
  <custom><numeric name="any" data="1 2"/></custom>
  <worldbody>
    <body name="arm" pos="0 0 1">
      <joint name="hinge" type="hinge" axis="0 1 0" damping="0.1 0.05" frictionloss="0.02" armature="0.01"
        stiffness="0.3" springref="0.1"/>
      <inertial pos="0.2 0 0" mass="0.5" diaginertia="0.002 0.003 0.002"/>
      <body name="sled" pos="0.4 0 0">
        <joint name="slide" type="slide" axis="1 0 0" damping="2" stiffness="50"/>
        <inertial pos="0 0 0" mass="0.2" diaginertia="0.0001 0.0001 0.0001"/>
      </body>
    </body>
    <body name="free" pos="3 0 1"><freejoint name="free"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>
  </worldbody>
  <tendon>
    <fixed name="belt" stiffness="3" damping="0.2" springlength="0.01 0.02" limited="true" range="-0.6 0.6">
      <joint joint="hinge" coef="1"/><joint joint="slide" coef="2"/></fixed>
  </tendon>
  <actuator>
    <position name="servo" joint="hinge" kp="4" kv="0.3" forcerange="-3 3"/>
    <motor name="pusher" joint="slide" gear="2" ctrlrange="-1.5 1.5"/>
    <general name="general" joint="hinge" gainprm="0.5" biastype="affine" biasprm="0.1 -0.2 -0.05"/>
    <general name="late" joint="hinge" gainprm="0.4" delay="0.004" nsample="8"/>
  </actuator>
</mujoco>)";

ModelPtr Compile(const std::string& xml) {
  const Scratch scratch;
  char message[1000] = "";
  ModelPtr model(mj_loadXML(scratch.Write("robot.xml", xml).c_str(), nullptr, message, sizeof message));
  EXPECT_TRUE(model) << message;
  return model;
}

// Positions over half a second under a command that varies.
std::vector<double> Motion(const mjModel* m) {
  const DataPtr d(mj_makeData(m));
  std::vector<double> motion;
  d->qvel[0] = 1;
  for (int k = 0; k < 250; ++k) {
    for (int i = 0; i < m->nu; ++i) d->ctrl[i] = 2 * std::sin(0.05 * k + i);
    mj_step(m, d.get());
    motion.insert(motion.end(), d->qpos, d->qpos + 2);
  }
  return motion;
}

struct FieldCase {
  const char* field;
  std::vector<double> values;
  const char* from;  // in the MJCF
  const char* to;
};

TEST(FieldsTest, AWrittenFieldMovesAsTheMjcfsOwn) {
  const std::vector<FieldCase> cases = {
      {"joint/hinge/damping", {0.4}, "damping=\"0.1 0.05\"", "damping=\"0.4 0.05\""},
      {"joint/hinge/damping_quadratic", {0.5}, "damping=\"0.1 0.05\"", "damping=\"0.1 0.5\""},
      {"joint/hinge/frictionloss", {0.3}, "frictionloss=\"0.02\"", "frictionloss=\"0.3\""},
      {"joint/hinge/armature", {0.03}, "armature=\"0.01\"", "armature=\"0.03\""},
      {"joint/hinge/stiffness", {2}, "stiffness=\"0.3\"", "stiffness=\"2\""},
      {"joint/hinge/springref", {-0.7}, "springref=\"0.1\"", "springref=\"-0.7\""},
      {"joint/slide/damping", {7}, "damping=\"2\"", "damping=\"7\""},
      {"joint/slide/stiffness", {20}, "stiffness=\"50\"", "stiffness=\"20\""},
      {"body/arm/mass", {0.8}, "mass=\"0.5\"", "mass=\"0.8\""},
      {"body/arm/inertia", {0.004, 0.006, 0.003}, "0.002 0.003 0.002", "0.004 0.006 0.003"},
      {"body/arm/ipos", {0.3, 0.01, 0.02}, "pos=\"0.2 0 0\"", "pos=\"0.3 0.01 0.02\""},
      {"body/sled/pos", {0.5, 0, 0.1}, "pos=\"0.4 0 0\"", "pos=\"0.5 0 0.1\""},
      {"actuator/servo/kp", {8}, "kp=\"4\"", "kp=\"8\""},
      {"actuator/servo/kv", {0.9}, "kv=\"0.3\"", "kv=\"0.9\""},
      {"actuator/servo/forcerange", {-1, 0.5}, "-3 3", "-1 0.5"},
      {"actuator/pusher/gain",
       {3},
       "<motor name=\"pusher\" joint=\"slide\"",
       "<general name=\"pusher\" joint=\"slide\" gainprm=\"3\""},
      {"actuator/pusher/gear", {5}, "gear=\"2\"", "gear=\"5\""},
      {"actuator/pusher/ctrlrange", {-0.5, 1}, "-1.5 1.5", "-0.5 1"},
      {"actuator/general/gain", {1.5}, "gainprm=\"0.5\"", "gainprm=\"1.5\""},
      {"actuator/general/bias0", {-0.3}, "0.1 -0.2 -0.05", "-0.3 -0.2 -0.05"},
      {"actuator/general/bias1", {-1}, "0.1 -0.2 -0.05", "0.1 -1 -0.05"},
      {"actuator/general/bias2", {-0.4}, "0.1 -0.2 -0.05", "0.1 -0.2 -0.4"},
      {"actuator/late/delay", {0.012}, "delay=\"0.004\"", "delay=\"0.012\""},
      {"tendon/belt/stiffness", {9}, "<fixed name=\"belt\" stiffness=\"3\"", "<fixed name=\"belt\" stiffness=\"9\""},
      {"tendon/belt/damping", {1}, "stiffness=\"3\" damping=\"0.2\"", "stiffness=\"3\" damping=\"1\""},
      {"tendon/belt/springlength", {-0.1, 0.2}, "0.01 0.02", "-0.1 0.2"},
      {"tendon/belt/range", {-0.1, 0.15}, "-0.6 0.6", "-0.1 0.15"},
      {"option/gravity", {1, 0, -5}, "gravity=\"0 0 -9.81\"", "gravity=\"1 0 -5\""},
  };
  const ModelPtr base = Compile(kRobot);
  const std::vector<double> before = Motion(base.get());
  for (const FieldCase& test : cases) {
    SCOPED_TRACE(test.field);
    const auto field = ResolveField(*base, test.field, "here");
    ASSERT_TRUE(field.ok()) << field.error().Text();
    ASSERT_EQ(field.value().components.size(), test.values.size());
    const ModelPtr written(mj_copyModel(nullptr, base.get()));
    for (std::size_t i = 0; i < test.values.size(); ++i)
      WriteComponent(*written, field.value().components[i], test.values[i]);
    const DataPtr scratch(mj_makeData(written.get()));
    if (field.value().derived) mj_setConst(written.get(), scratch.get());
    const ModelPtr expected = Compile(Replaced(kRobot, test.from, test.to));
    const std::vector<double> actual = Motion(written.get()), wanted = Motion(expected.get());
    double difference = 0, change = 0;
    for (std::size_t i = 0; i < actual.size(); ++i) {
      difference = std::max(difference, std::abs(actual[i] - wanted[i]));
      change = std::max(change, std::abs(actual[i] - before[i]));
    }
    // MuJoCo's compiler rounds inertial frames differently from a body that was written.
    constexpr double kRounding = 1e-10;
    EXPECT_LT(difference, kRounding);
    EXPECT_GT(change, 1e-5) << "the field does nothing here";
  }
}

TEST(FieldsTest, NumericsAreWrittenWhole) {
  const ModelPtr model = Compile(kRobot);
  const auto field = ResolveField(*model, "numeric/any", "");
  ASSERT_TRUE(field.ok());
  ASSERT_EQ(field.value().components.size(), 2u);
  WriteComponent(*model, field.value().components[1], 7);
  EXPECT_EQ(model->numeric_data[0], 1);
  EXPECT_EQ(model->numeric_data[1], 7);
}

TEST(FieldsTest, ARangeIsItsActuatorsOwnBesideOneOfSeveralForces) {
  const ModelPtr model = Compile(R"(<mujoco>
    <worldbody>
      <body><joint name="ball" type="ball"/><geom size="0.1"/></body>
      <body pos="3 0 0"><joint name="hinge"/><geom size="0.1"/></body>
    </worldbody>
    <actuator>
      <orientation name="turret" joint="ball" kp="1"/>
      <position name="servo" joint="hinge" kp="2" forcerange="-3 4" ctrlrange="-5 6"/>
    </actuator>
  </mujoco>)");
  ASSERT_TRUE(model);
  ASSERT_EQ(model->actuator_outadr[1], 3);  // the turret has three forces and three controls
  ASSERT_EQ(model->actuator_ctrladr[1], 3);
  for (const auto& [text, low, high] :
       {std::tuple{"actuator/servo/forcerange", -3.0, 4.0}, std::tuple{"actuator/servo/ctrlrange", -5.0, 6.0}}) {
    const auto field = ResolveField(*model, text, "");
    ASSERT_TRUE(field.ok());
    const char* buffer = static_cast<const char*>(model->buffer);
    EXPECT_EQ(*reinterpret_cast<const mjtNum*>(buffer + field.value().components[0][0].offset), low) << text;
    EXPECT_EQ(*reinterpret_cast<const mjtNum*>(buffer + field.value().components[1][0].offset), high) << text;
  }
}

TEST(FieldsTest, WrongFieldsNameTheNearest) {
  const ModelPtr model = Compile(kRobot);
  const std::vector<std::array<const char*, 2>> cases = {{"joint/hinge/dampng", "did you mean 'damping'?"},
                                                         {"joint/hing/damping", "did you mean 'hinge'?"},
                                                         {"joints/hinge/damping", "did you mean 'joint'?"},
                                                         {"body/amr/mass", "did you mean 'arm'?"},
                                                         {"body/arm/mas", "did you mean 'mass'?"},
                                                         {"actuator/serve/kp", "did you mean 'servo'?"},
                                                         {"actuator/servo/ki", "did you mean 'kp'?"},
                                                         {"tendon/bolt/stiffness", "did you mean 'belt'?"},
                                                         {"tendon/belt/length", "stiffness"},
                                                         {"numeric/nay", "no such numeric"},
                                                         {"numeric/any/1", "no such numeric"},
                                                         {"option/timestep", "option"},
                                                         {"joint/free/damping", "neither hinge nor slide"},
                                                         {"", "not a field"},
                                                         {"/", "not a field"},
                                                         {"joint", "not a field"},
                                                         {"joint/", "not a field"},
                                                         {"joint/hinge", "unknown field of a joint"},
                                                         {"//", "not a field"},
                                                         {"joint//damping", "no such joint"},
                                                         {"body/world/mass/x", "no such body"}};
  for (const auto& [text, says] : cases) {
    const auto field = ResolveField(*model, text, "e.yaml:3:1");
    ASSERT_FALSE(field.ok()) << text;
    EXPECT_NE(field.error().Text().find(says), std::string::npos) << text << ": " << field.error().Text();
    EXPECT_EQ(field.error().where, "e.yaml:3:1");
  }
}

}  // namespace
}  // namespace gapscope::testing
