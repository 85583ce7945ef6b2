// gapscope.encoder against the motion it reads.
#include <cmath>

#include "tests/plugins/motor_testing.h"

namespace gapscope::testing {
namespace {

constexpr double kEncoderRounding = 1e-12;

// A joint with a plain motor and an encoder.
std::string Xml(const Attributes& config, const Attributes& live, const std::string& option = "timestep='0.001'",
                const std::string& objtype = "joint") {
  std::string text = "<mujoco><option gravity='0 0 0' " + option +
                     "/><extension><plugin plugin='gapscope.encoder'><instance name='encoder'>";
  for (const auto& [key, value] : config) text += "<config key='" + key + "' value='" + value + "'/>";
  text +=
      "</instance></plugin></extension><worldbody><body name='body'><joint name='joint' axis='0 0 1'/>"
      "<inertial pos='0 0 0' mass='1' diaginertia='0.1 0.1 0.1'/></body></worldbody><custom>";
  for (const auto& [key, value] : live) text += "<numeric name='encoder." + key + "' data='" + value + "'/>";
  return text + "</custom><actuator><motor joint='joint'/></actuator><sensor><plugin objtype='" + objtype +
         "' objname='" + objtype + "' plugin='gapscope.encoder' instance='encoder'/></sensor></mujoco>";
}

ModelPtr Compile(const std::string& xml, std::string* message = nullptr) {
  LoadPlugins();
  char error[2000] = "";
  SpecPtr spec(mj_parseXMLString(xml.c_str(), nullptr, error, sizeof error));
  ModelPtr m(spec ? mj_compile(spec.get(), nullptr) : nullptr);
  if (!m && message) *message = spec ? mjs_getError(spec.get()) : error;
  return m;
}

TEST(EncoderTest, NeutralIsTheJointAngle) {
  const ModelPtr m = Compile(Xml({}, {}));
  ASSERT_TRUE(m);
  EXPECT_EQ(m->nsensordata, 1);
  const DataPtr d(mj_makeData(m.get()));
  d->qpos[0] = 0.123456789, d->qvel[0] = 2;
  for (int k = 0; k < 5; ++k) {
    const double q = d->qpos[0];
    mj_step(m.get(), d.get());
    EXPECT_EQ(d->sensordata[0], q);
  }
}

TEST(EncoderTest, OffsetThenQuantisation) {
  const ModelPtr m = Compile(Xml({{"resolution_rad", "0.01"}}, {{"offset_rad", "0.004"}}));
  const DataPtr d(mj_makeData(m.get()));
  for (double q = -0.05; q < 0.05; q += 0.00037) {
    d->qpos[0] = q;
    mj_forward(m.get(), d.get());
    EXPECT_NEAR(d->sensordata[0], 0.01 * std::round((q + 0.004) / 0.01), kEncoderRounding);
    EXPECT_LE(std::abs(d->sensordata[0] - q - 0.004), 0.005 + kEncoderRounding);
  }
}

// Under a constant torque and RK4 the motion is a parabola, which Hermite interpolation meets exactly.
TEST(EncoderTest, FractionalDelayIsTheExactShift) {
  const ModelPtr m = Compile(Xml({{"velocity", "false"}}, {{"delay_s", "0"}}, "timestep='0.001' integrator='RK4'"));
  const DataPtr d(mj_makeData(m.get()));
  for (const double delay : {0.0003, 0.001, 0.00425, 0.0331}) {
    mj_resetData(m.get(), d.get());
    m->numeric_data[0] = delay;
    d->qvel[0] = 0.7;
    d->ctrl[0] = 0.2;
    const auto exact = [](double t) { return t < 0 ? 0.7 * t : 0.7 * t + 0.5 * 0.2 / 0.1 * t * t; };
    for (int k = 0; k < 200; ++k) {
      mj_step(m.get(), d.get());
      ASSERT_NEAR(d->sensordata[0], exact(0.001 * k - delay), 1e-6) << delay << " " << k;
      if (0.001 * k > delay) {
        ASSERT_NEAR(d->sensordata[0], exact(0.001 * k - delay), 1e-11);
      }
    }
  }
}

TEST(EncoderTest, SpeedIsTheFilteredDifferenceOfReadings) {
  const double resolution = 2 * 3.14159265358979 / 4096, constant = 0.005, h = 0.001;
  const ModelPtr m = Compile(Xml({{"velocity", "true"}, {"resolution_rad", std::to_string(resolution)}},
                                 {{"time_constant_s", std::to_string(constant)}}));
  ASSERT_EQ(m->nsensordata, 2);
  const DataPtr d(mj_makeData(m.get()));
  d->qvel[0] = 1.3;
  double angle = 0, speed = 1.3;
  for (int k = 0; k < 400; ++k) {
    mj_step(m.get(), d.get());
    if (k > 0) speed += (1 - std::exp(-h / constant)) * ((d->sensordata[0] - angle) / h - speed);
    angle = d->sensordata[0];
    ASSERT_NEAR(d->sensordata[1], speed, 1e-9) << k;
  }
  EXPECT_NEAR(speed, 1.3, 0.4);  // a count a step is 1.5 rad/s: ripple stays, about the true speed
  m->numeric_data[0] = 0;        // no filter: the raw difference
  const double before = d->sensordata[0];
  mj_step(m.get(), d.get());
  EXPECT_NEAR(d->sensordata[1], (d->sensordata[0] - before) / h, 1e-9);
}

TEST(EncoderTest, ResetAndSetStateRepeatBitForBit) {
  const ModelPtr m =
      Compile(Xml({{"velocity", "true"}, {"resolution_rad", "0.002"}},
                  {{"delay_s", "0.0033"}, {"time_constant_s", "0.004"}}, "timestep='0.002' integrator='RK4'"));
  const DataPtr d(mj_makeData(m.get()));
  const auto run = [&](int from, int to) {
    std::vector<double> readings;
    for (int k = from; k < to; ++k) {
      d->ctrl[0] = std::sin(0.05 * k);
      mj_step(m.get(), d.get());
      readings.insert(readings.end(), {d->sensordata[0], d->sensordata[1]});
    }
    return readings;
  };
  const std::vector<double> first = run(0, 200);
  std::vector<double> state(mj_stateSize(m.get(), mjSTATE_INTEGRATION));
  mj_getState(m.get(), d.get(), state.data(), mjSTATE_INTEGRATION);
  const std::vector<double> rest = run(200, 300);
  mj_setState(m.get(), d.get(), state.data(), mjSTATE_INTEGRATION);
  EXPECT_EQ(run(200, 300), rest);
  mj_resetData(m.get(), d.get());
  EXPECT_EQ(run(0, 200), first);
}

TEST(EncoderTest, WrongAttributesAreExplained) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> cases = {
      {Xml({{"resolution_rad", "-1"}}, {}), {"'encoder'", "'resolution_rad'", "allowed 0"}},
      {Xml({{"resolution_rad", "fine"}}, {}), {"'resolution_rad'", "'fine'", "number"}},
      {Xml({{"velocity", "yes"}}, {}), {"'velocity'", "'yes'", "true, false"}},
      {Xml({{"delay_s", "0.2"}}, {}), {"'delay_s'", "0.2", "raise max_delay_s"}},
      {Xml({{"max_delay_s", "-1"}}, {}), {"'max_delay_s'", "0 to 10"}},
      {Xml({}, {}, "timestep='0.001'", "body"), {"hinge or slide", "objtype=\"joint\""}}};
  for (const auto& [xml, says] : cases) {
    std::string message;
    LoadPlugins();
    const auto handler = mju_user_warning;
    mju_user_warning = nullptr;
    EXPECT_FALSE(Compile(xml, &message));
    mju_user_warning = handler;
    for (const std::string& part : says) EXPECT_NE(message.find(part), std::string::npos) << part << "\n" << message;
  }
}

}  // namespace
}  // namespace gapscope::testing
