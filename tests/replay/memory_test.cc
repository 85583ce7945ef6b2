// What a run remembers of the time before its first stamp: delays, lags and earlier commands.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "replay/simulator.h"
#include "tests/replay/disc.h"

namespace gapscope::testing {
namespace {

class DelayTest : public SimulatorTest {
 protected:
  std::vector<std::vector<double>> Delayed(const Recording& recording, const char* effect, double delay_s,
                                           double step_s = 0) {
    const auto uses = ParseEffects({effect}, *model_->rig());
    EXPECT_TRUE(uses.ok());
    const auto model = MakeModel(experiment_, uses.value());
    return Predict(*model, recording, {{uses.value()[0].Text() + ".delay_s", delay_s}}, nullptr, step_s);
  }
};

TEST_F(DelayTest, WholeSamplesAreAnExactShift) {
  Recording recording =
      MakeRecording(experiment_, 300, 0.002, [](int, double t) { return std::sin(20 * t) + (t > 0.3 ? 0.5 : 0); });
  const auto late = Delayed(recording, "command_delay", 7 * 0.002);
  Recording shifted = recording;
  auto& u = shifted.commands[0].values;
  std::rotate(u.begin(), u.end() - 7, u.end());
  std::fill_n(u.begin(), 7, recording.commands[0].values[0]);
  const auto expected = Predict(*model_, shifted);
  EXPECT_LT(LargestDifference(late[0], expected[0]), 1e-12);
}

TEST_F(DelayTest, AFractionalDelayOfHeldCommandsIsTheLinearSystemsOwn) {
  const Recording recording = Irregular(experiment_, 200);
  for (const double delay_s : {0.0004, 0.00137, 0.0101, 0.05}) {
    const auto late = Delayed(recording, "command_delay", delay_s);
    // A step gets the mean of what acts during it: the impulse is exact, its place within the step is not; u h^2 / (8
    // J) per switch, of either sign.
    constexpr double kWithinStep = 3e-5;
    EXPECT_LT(WorstAngle(late[0], Exact(recording, delay_s)), kWithinStep) << delay_s;
    // Four times finer: sixteen times better, within what random signs leave.
    EXPECT_LT(WorstAngle(Delayed(recording, "command_delay", delay_s, 0.00025)[0], Exact(recording, delay_s)),
              kWithinStep / 4)
        << delay_s;
  }
}

// A log that begins with a step: before it the disc stood still, and nothing was asked of it.
TEST_F(DelayTest, ALogThatBeginsAtRestBeganWithoutACommand) {
  const double step = 0.7, delay_s = 0.0137;
  Recording recording = MakeRecording(experiment_, 300, 0.002, [&](int, double) { return step; });
  EXPECT_LT(WorstAngle(Delayed(recording, "command_delay", delay_s)[0], Exact(recording, delay_s, 0)), 3e-5);
  // It moves off after that time, on a sensor whose resolution nobody states.
  const auto move_off = [&](double late_s) {
    for (std::size_t k = 0; k < recording.rows(); ++k) {
      recording.measured[0].values[k] =
          0.5 * step / kInertia * std::pow(std::max(0.0, recording.time_s[k] - late_s), 2) + (k % 2 == 0 ? 0 : 1e-4);
    }
  };
  move_off(delay_s);
  EXPECT_LT(WorstAngle(Delayed(recording, "command_delay", delay_s)[0], Exact(recording, delay_s, 0)), 3e-5);
  // At once, under its first command: however late commands are, that one was there before.
  move_off(0);
  EXPECT_LT(WorstAngle(Delayed(recording, "command_delay", delay_s)[0], Exact(recording, delay_s, step)), 3e-5);
  // One that begins in motion was driven by nobody knows what: by the first command.
  for (std::size_t k = 0; k < recording.rows(); ++k) recording.measured[0].values[k] = 2 * recording.time_s[k];
  EXPECT_LT(WorstAngle(Delayed(recording, "command_delay", delay_s)[0], Exact(recording, delay_s, step)), 3e-5);
}

TEST_F(SimulatorTest, ALaggingDriveStartsFromRestWithTheLog) {
  // J w' + b w = u (1 - exp(-t / T)).
  const double u = 0.7, time_constant_s = 0.03, rate = kDamping / kInertia, lag = 1 / time_constant_s;
  const auto uses = ParseEffects({"actuator_lag@motor"}, *model_->rig());
  ASSERT_TRUE(uses.ok());
  const auto model = MakeModel(experiment_, uses.value());
  const Recording recording = MakeRecording(experiment_, 300, 0.002, [&](int, double) { return u; });
  const auto predicted = Predict(*model, recording, {{"actuator_lag@motor.time_constant_s", time_constant_s}});
  for (std::size_t k = 0; k < recording.rows(); ++k) {
    const double t = recording.time_s[k];
    const double w = u / kDamping * (1 - std::exp(-rate * t)) -
                     u / kInertia * (std::exp(-lag * t) - std::exp(-rate * t)) / (rate - lag);
    ASSERT_NEAR(predicted[1][k], w, 1e-6) << t;
  }
}

TEST(SimulatorMemoryTest, AMotorRemembersBesideAnActuatorWithoutControls) {
  // A passive drive on a joint of its own makes more actuators than controls; the motor behind it still is one that
  // remembers, so its late torque is that of before the window.
  const Scratch scratch;
  const auto predicted = [&](const std::string& beside) {
    const std::string mjcf =
        R"(<mujoco><option timestep="0.001" gravity="0 0 0"/><extension><plugin plugin="gapscope.motor">
          <instance name="drive">
          <config key="law" value="torque"/><config key="torque_delay_s" value="0.02"/></instance></plugin></extension>
        <worldbody><body><joint name="hinge" damping="0.05"/>
          <inertial pos="0 0 0" mass="1" diaginertia="0.02 0.02 0.02"/></body>
          <body><joint name="other"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>
        <actuator>)" +
        beside + R"(<plugin name="motor" joint="hinge" plugin="gapscope.motor" instance="drive"/></actuator></mujoco>)";
    const auto experiment = MakeExperiment(scratch, mjcf,
                                           "commands:\n  - {actuator: motor, column: u, unit: N m}\nmeasured:\n  - "
                                           "{signal: q, column: q, joint: hinge, unit: rad}\n");
    const auto model = MakeModel(experiment);
    const Recording recording =
        MakeRecording(experiment, 100, 0.002, [](int, double t) { return t < 0.1 ? 1.0 : -1.0; });
    Simulator simulator(*model, 0);
    EXPECT_TRUE(simulator.SetParameters(model->Nominal(), recording));
    std::vector<double> angle(38);
    EXPECT_EQ(simulator.Run(recording, {52, 90}, AtRest(*model), angle).outcome, Outcome::kCompleted);
    return angle;
  };
  EXPECT_EQ(predicted(R"(<dcmotor name="passive" joint="other" motorconst="1 1" resistance="1" input="none"/>)"),
            predicted(""));
}

TEST(EarlierCommandsTest, WhatHoldsAWeightHeldItBeforeTheLog) {
  // A spring-loaded disc that its first command holds still: the lag has nothing to do.
  const Scratch scratch;
  const Experiment experiment =
      MakeExperiment(scratch, Mjcf("damping=\"0.05\" stiffness=\"2\" springref=\"0.4\""), kYaml);
  const auto uses = ParseEffects({"actuator_lag@motor"}, *MakeModel(experiment)->rig());
  ASSERT_TRUE(uses.ok());
  const auto model = MakeModel(experiment, uses.value());
  const Recording recording = MakeRecording(experiment, 300, 0.002, [](int, double) { return -0.8; });
  const auto predicted = Predict(*model, recording, {{"actuator_lag@motor.time_constant_s", 0.03}});
  EXPECT_LT(Largest(predicted[0]), 1e-9);
}

TEST_F(DelayTest, ALateSensorShowsThePast) {
  Recording recording = MakeRecording(experiment_, 400, 0.002, [](int, double t) { return std::sin(15 * t); });
  const auto on_time = Predict(*model_, recording), late = Delayed(recording, "sensor_delay@q", 0.0052);
  // Exact at stamps for whole samples.
  const auto whole = Delayed(recording, "sensor_delay@q", 0.006);
  for (std::size_t k = 3; k < 400; ++k) ASSERT_NEAR(whole[0][k], on_time[0][k - 3], 1e-12) << k;
  EXPECT_EQ(whole[1], on_time[1]) << "the other sensor is on time";
  // In between by the cubic: against a run with stamps ten times as dense.
  const Recording dense = [&] {
    Recording d = MakeRecording(experiment_, 3991, 0.0002, [&](int, double) { return 0.0; });
    for (std::size_t k = 0; k < d.rows(); ++k) d.commands[0].values[k] = recording.commands[0].values[k / 10];
    return d;
  }();
  const auto fine = Predict(*model_, dense);
  for (std::size_t k = 5; k < 399; ++k) ASSERT_NEAR(late[0][k], fine[0][10 * k - 26], 2e-6) << k;
}

// An MJCF's own delay, in the middle of a log and at steps shorter than its own: what was commanded before the window.
TEST_F(SimulatorTest, AWindowRemembersWhatTheMjcfDelays) {
  const auto model_of = [&](const Scratch& scratch, const std::string& delay) {
    std::string mjcf = Mjcf("damping=\"0.05\"", "<motor name=\"motor\" joint=\"hinge\"" + delay + "/>");
    mjcf.replace(mjcf.find("RK4"), 3, "Euler");
    mjcf.replace(mjcf.find("timestep=\"0.001\""), 16, "timestep=\"0.002\"");
    return MakeModel(MakeExperiment(scratch, mjcf, kYaml));
  };
  const Scratch late_folder, on_time_folder;
  const auto late = model_of(late_folder, " delay=\"0.01\" nsample=\"6\""), on_time = model_of(on_time_folder, "");
  Recording log =
      MakeRecording(late->experiment(), 200, 0.002, [](int, double t) { return std::sin(40 * t) > 0 ? 0.3 : -0.2; });
  Recording shifted = log;
  for (std::size_t k = 0; k < 200; ++k) shifted.commands[0].values[k] = k < 5 ? 0 : log.commands[0].values[k - 5];
  const Window window{100, 180};
  const auto run = [&](const Model& model, const Recording& recording) {
    Simulator simulator(model, 0.0005);
    EXPECT_TRUE(simulator.SetParameters(model.Nominal(), recording));
    std::vector<double> predicted(2 * window.rows());
    EXPECT_EQ(simulator.Run(recording, window, {.qpos = {0.1}, .qvel = {0.2}}, predicted).outcome, Outcome::kCompleted);
    return predicted;
  };
  EXPECT_LT(LargestDifference(run(*late, log), run(*on_time, shifted)), 1e-9);
  EXPECT_GT(LargestDifference(run(*late, log), run(*on_time, log)), 1e-3);
}

}  // namespace
}  // namespace gapscope::testing
