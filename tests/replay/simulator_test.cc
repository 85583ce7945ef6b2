// One recording through one model, against exact solutions: J w' = u - b w with commands held between irregular stamps.
#include "replay/simulator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

constexpr double kInertia = 0.02, kDamping = 0.05;
// RK4 at 1 ms: (h b / J)^5 / 120 a step.
constexpr double kIntegration = 1e-10;

std::string Mjcf(const std::string& joint = "damping=\"0.05\"",
                 const std::string& actuators = "<motor name=\"motor\" joint=\"hinge\"/>") {
  return "<mujoco><compiler angle=\"radian\"/><option timestep=\"0.001\" integrator=\"RK4\" gravity=\"0 0 0\"><flag "
         "contact=\"disable\"/></option><worldbody><body name=\"disc\"><joint name=\"hinge\" axis=\"0 0 1\" " +
         joint +
         "/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"0.015 0.015 0.02\"/></body></worldbody><actuator>" +
         actuators + "</actuator></mujoco>";
}
constexpr const char* kYaml = R"(commands:
  - {actuator: motor, column: u, unit: N m}
measured:
  - {signal: q, column: q, joint: hinge, unit: rad, offset: q.offset}
  - {signal: w, column: w, kind: velocity, joint: hinge}
parameters:
  q.offset: {unit: rad, nominal: 0, bounds: [-1, 1]}
)";

struct State {
  double q = 0, w = 0;
};
// Exactly `t` later under a constant torque.
State Held(State s, double u, double t) {
  const double rate = kDamping / kInertia, end = u / kDamping, decay = std::exp(-rate * t);
  return {s.q + end * t + (s.w - end) * (1 - decay) / rate, end + (s.w - end) * decay};
}

// Stamps of 0.3 to 9 ms and a command that jumps at each.
Recording Irregular(const Experiment& experiment, int rows) {
  Recording recording = MakeRecording(experiment, rows, 0.002, [](int, double) { return 0.0; });
  std::mt19937 random(5);
  double t = 0;
  for (std::size_t k = 0; k < recording.rows(); ++k) {
    recording.time_s[k] = t;
    t += 0.0003 + 0.0087 * static_cast<double>(random() % 1000) / 1000;
    for (auto& command : recording.commands) command.values[k] = static_cast<double>(random() % 2001) / 1000 - 1;
  }
  return recording;
}

// The exact motion, the command being late by `delay_s`; `earlier`: what was commanded before the log's start.
std::vector<State> Exact(const Recording& r, double delay_s = 0, double earlier = 0) {
  std::vector<State> states = {{}};
  State s;
  const auto& u = r.commands[0].values;
  for (std::size_t k = 0; k + 1 < r.rows(); ++k) {
    double t = r.time_s[k];
    while (t < r.time_s[k + 1]) {
      if (t + 1e-13 < r.time_s[0] + delay_s) {
        const double until = std::min(r.time_s[0] + delay_s, r.time_s[k + 1]);
        s = Held(s, earlier, until - t);
        t = until;
        continue;
      }
      // What acts at t: the last command sent at or before t - delay; until when.
      std::size_t held = 0;
      while (held + 1 < r.rows() && r.time_s[held + 1] + delay_s <= t + 1e-13) ++held;
      const double until =
          held + 1 < r.rows() ? std::min(r.time_s[held + 1] + delay_s, r.time_s[k + 1]) : r.time_s[k + 1];
      s = Held(s, u[held], until - t);
      t = until;
    }
    states.push_back(s);
  }
  return states;
}

double WorstAngle(const std::vector<double>& q, const std::vector<State>& exact) {
  double worst = 0;
  for (std::size_t k = 0; k < q.size(); ++k) worst = std::max(worst, std::abs(q[k] - exact[k].q));
  return worst;
}

class SimulatorTest : public ::testing::Test {
 protected:
  SimulatorTest() : experiment_(MakeExperiment(scratch_, Mjcf(), kYaml)), model_(MakeModel(experiment_)) {}
  Scratch scratch_;
  Experiment experiment_;
  std::shared_ptr<const Model> model_;
};

TEST_F(SimulatorTest, HoldsCommandsByStampOnAnIrregularLog) {
  const Recording recording = Irregular(experiment_, 400);
  const auto predicted = Predict(*model_, recording);
  const auto exact = Exact(recording);
  EXPECT_LT(WorstAngle(predicted[0], exact), kIntegration);
  for (std::size_t k = 0; k < exact.size(); ++k) ASSERT_NEAR(predicted[1][k], exact[k].w, 1e-9) << k;
}

// An IMU and a marker at radius r on the disc under gravity g along the axis: the accelerometer reads -r w^2, r w' and
// g in the disc's frame.
TEST(SensorsTest, MujocosSensorsReadTheExactMotion) {
  constexpr double kRadius = 0.3;
  std::string mjcf = Mjcf();
  const auto replace = [&](const std::string& from, const std::string& to) {
    mjcf.replace(mjcf.find(from), from.size(), to);
  };
  replace("gravity=\"0 0 0\"", "gravity=\"0 0 -9.81\"");
  replace("</body></worldbody>", "<site name=\"imu\" pos=\"0.3 0 0.02\"/></body></worldbody>");
  replace("</mujoco>", R"(<sensor><gyro name="gyro" site="imu"/><accelerometer name="imu" site="imu"/>
    <framepos name="marker" objtype="site" objname="imu"/><jointpos name="angle" joint="hinge"/></sensor></mujoco>)");
  Scratch scratch;
  const Experiment experiment = MakeExperiment(scratch, mjcf, R"(commands:
  - {actuator: motor, column: u, unit: N m}
measured:
  - {signal: gyro, sensor: gyro, columns_of_elements: [gx, gy, gz], unit: deg/s}
  - {signal: acc, sensor: imu, columns_of_elements: [ax, ay, az], unit: gn}
  - {signal: y, sensor: marker, element: 1, column: y, unit: mm}
  - {signal: angle, sensor: angle, column: angle, unit: rad}
  - {signal: q, column: q, joint: hinge, unit: rad}
)");
  ASSERT_EQ(experiment.measured.size(), 9u);
  EXPECT_EQ(experiment.measured[2].signal, "gyro[2]");
  EXPECT_EQ(experiment.measured[2].columns, std::vector<std::string>{"gz"});
  EXPECT_DOUBLE_EQ(experiment.measured[4].factor, 9.80665);
  const auto model = MakeModel(experiment);
  ASSERT_NE(model, nullptr);
  const Recording recording = Irregular(experiment, 200);
  const auto predicted = Predict(*model, recording);
  const auto exact = Exact(recording);
  for (std::size_t k = 0; k < exact.size(); ++k) {
    const double w = exact[k].w, u = recording.commands[0].values[k > 0 ? k - 1 : 0];
    const double turning = (u - kDamping * w) / kInertia;
    ASSERT_NEAR(predicted[0][k], 0, 1e-12);
    ASSERT_NEAR(predicted[2][k], w, 1e-9) << k;
    ASSERT_NEAR(predicted[3][k], -kRadius * w * w, 1e-8) << k;
    ASSERT_NEAR(predicted[4][k], kRadius * turning, 1e-7) << k;
    ASSERT_NEAR(predicted[5][k], 9.81, 1e-9) << k;
    ASSERT_NEAR(predicted[6][k], kRadius * std::sin(exact[k].q), 1e-9) << k;
    ASSERT_NEAR(predicted[7][k], exact[k].q, kIntegration) << k;
  }
  // Reading sensors changes no motion.
  Scratch other;
  const Experiment bare = MakeExperiment(other, mjcf, kYaml);
  EXPECT_LT(LargestDifference(Predict(*MakeModel(bare), Irregular(bare, 200))[0], predicted[8]), 1e-15);
}

TEST_F(SimulatorTest, LandsOnEveryStampWithTheFewestSteps) {
  Recording recording = MakeRecording(experiment_, 5, 1, [](int, double) { return 0.0; });
  recording.time_s = {0, 0.0005, 0.0035, 0.0055, 0.0055 + 0.00201};
  std::vector<double> predicted(10);
  const auto steps = [&](double max_step_s, Window window) {
    Simulator simulator(*model_, max_step_s);
    EXPECT_TRUE(simulator.SetParameters(model_->Nominal(), recording));
    const std::size_t taken = simulator.Run(recording, window, AtRest(*model_), predicted).steps;
    EXPECT_EQ(simulator.data().time, recording.time_s[window.end - 1]);
    return taken;
  };
  EXPECT_EQ(steps(0.001, {0, 5}), 1u + 3 + 2 + 3);
  // A finer limit makes more steps, a coarser one never fewer than one per stamp.
  EXPECT_EQ(steps(0.0005, {0, 5}), 1u + 6 + 4 + 5);
  EXPECT_EQ(steps(1, {0, 5}), 4u);
  EXPECT_EQ(steps(0.001, {3, 4}), 0u);
}

TEST_F(SimulatorTest, AWindowFromTheTrueStateIsAPieceOfTheFreeRun) {
  const Recording recording = Irregular(experiment_, 200);
  const auto whole = Predict(*model_, recording);
  Simulator simulator(*model_, 0);
  ASSERT_TRUE(simulator.SetParameters(model_->Nominal(), recording));
  const InitialState start{.qpos = {whole[0][50]}, .qvel = {whole[1][50]}};
  std::vector<double> piece(2 * 70);
  ASSERT_EQ(simulator.Run(recording, {50, 120}, start, piece).outcome, Outcome::kCompleted);
  for (std::size_t r = 0; r < 70; ++r) ASSERT_NEAR(piece[2 * r], whole[0][50 + r], 1e-13) << r;
  EXPECT_EQ(piece[0], whole[0][50]);
  // The same bytes again, whatever ran before.
  std::vector<double> other(2 * 200), again(2 * 70);
  (void)simulator.Run(recording, {0, 200}, AtRest(*model_), other);
  (void)simulator.Run(recording, {50, 120}, start, again);
  EXPECT_EQ(piece, again);
}

TEST_F(SimulatorTest, TheInitialStateComesFromTheLog) {
  Recording recording = MakeRecording(experiment_, 100, 0.002, [](int, double) { return 0.0; });
  for (std::size_t k = 0; k < recording.rows(); ++k) recording.measured[0].values[k] = 0.3 + 1.5 * recording.time_s[k];
  // The parameter offset: predicted = model + offset, so the model starts at measured - offset.
  const InitialState state = InitialStateAt(*model_, recording, 40, std::vector<double>{0.1});
  EXPECT_NEAR(state.qpos[0], 0.3 + 1.5 * 0.08 - 0.1, 1e-12);
  EXPECT_NEAR(state.qvel[0], 1.5, 1e-9);
  // Without a measured angle the measured speed counts.
  recording.measured.erase(recording.measured.begin());
  for (double& w : recording.measured[0].values) w = -2;
  const InitialState speed = InitialStateAt(*model_, recording, 40, std::vector<double>{0.1});
  EXPECT_EQ(speed.qpos[0], 0);
  EXPECT_NEAR(speed.qvel[0], -2, 1e-12);
}

TEST(InitialStateTest, AJointThatIsTiedToAMeasuredOneStartsWithIt) {
  // A gripper of two fingers of which one is logged, either the first or the second of the equality.
  for (const char* measured : {"a", "b"}) {
    const Scratch scratch;
    const auto finger = [](const std::string& name) {
      return "<body><joint name='" + name + "' type='slide' ref='0.01'/><geom size='0.01'/></body>";
    };
    const Experiment e = MakeExperiment(
        scratch,
        "<mujoco><worldbody>" + finger("a") + finger("b") +
            "</worldbody><equality><joint joint1='a' joint2='b' polycoef='0.002 -1 0.5 0 0'/></equality></mujoco>",
        std::string("measured:\n  - {signal: q, column: q, joint: ") + measured + ", unit: m}\n");
    const auto model = MakeModel(e);
    ASSERT_NE(model, nullptr);
    Recording recording = MakeRecording(e, 100, 0.002, [](int, double) { return 0.0; });
    for (std::size_t k = 0; k < recording.rows(); ++k)
      recording.measured[0].values[k] = 0.02 + 0.1 * recording.time_s[k];
    const InitialState state = InitialStateAt(*model, recording, 50, {});
    const double b = state.qpos[1] - 0.01, a = 0.002 - b + 0.5 * b * b;
    EXPECT_NEAR(state.qpos[measured[0] - 'a'], 0.03, 1e-9);
    EXPECT_NEAR(state.qpos[0], 0.01 + a, 1e-12);
    EXPECT_NEAR(state.qvel[0], (b - 1) * state.qvel[1], 1e-9);
    EXPECT_NEAR(state.qvel[measured[0] - 'a'], 0.1, 1e-6);
  }
}

TEST_F(SimulatorTest, AnOffsetIsAddedToThePrediction) {
  const Recording recording = Irregular(experiment_, 50);
  const auto plain = Predict(*model_, recording), moved = Predict(*model_, recording, {{"q.offset", 0.25}});
  for (std::size_t k = 0; k < plain[0].size(); ++k) {
    ASSERT_EQ(moved[0][k], plain[0][k] + 0.25);
    ASSERT_EQ(moved[1][k], plain[1][k]);
  }
}

TEST_F(SimulatorTest, DivergenceIsAnOutcomeWithItsTime) {
  // A negative spring: q grows by exp(sqrt(k / J) t) and passes 10^6 rad at t = ln(2e6 / q0) / sqrt(k / J).
  const Scratch scratch;
  const Experiment experiment = MakeExperiment(
      scratch,
      Mjcf("", "<general name=\"motor\" joint=\"hinge\" gainprm=\"1\" biastype=\"affine\" biasprm=\"0 8 0\"/>"), kYaml);
  const auto model = MakeModel(experiment);
  const Recording recording = MakeRecording(experiment, 1001, 0.002, [](int, double) { return 0.0; });
  Simulator simulator(*model, 0);
  ASSERT_TRUE(simulator.SetParameters(model->Nominal(), recording));
  std::vector<double> predicted(2 * 1001, 7.0);
  const RunResult run = simulator.Run(recording, {0, 1001}, {.qpos = {0.01}, .qvel = {0}}, predicted);
  ASSERT_EQ(run.outcome, Outcome::kDiverged);
  EXPECT_NEAR(run.diverged_at_s, std::log(2e6 / 0.01) / std::sqrt(8 / kInertia), 0.004);
  const auto last = static_cast<std::size_t>(std::lround(run.diverged_at_s / 0.002));
  EXPECT_LT(std::abs(predicted[2 * last]), 1e6);
  for (std::size_t i = 2 * (last + 1); i < predicted.size(); ++i) ASSERT_TRUE(std::isnan(predicted[i]));
  // And the worker is as good as new afterwards.
  std::vector<double> short_run(2 * 10);
  EXPECT_EQ(simulator.Run(recording, {0, 10}, {.qpos = {0.01}, .qvel = {0}}, short_run).outcome, Outcome::kCompleted);
  EXPECT_EQ(short_run[0], 0.01);
}

TEST_F(SimulatorTest, AStepTooLongForTheModelDivergesToo) {
  // Explicit integration of a stiff damper: w' = -5000 w at 2 ms.
  const Scratch scratch;
  const Experiment experiment = MakeExperiment(
      scratch,
      Mjcf("", "<general name=\"motor\" joint=\"hinge\" gainprm=\"1\" biastype=\"affine\" biasprm=\"0 0 -100\"/>"),
      kYaml);
  const auto model = MakeModel(experiment);
  const Recording recording = MakeRecording(experiment, 200, 0.002, [](int, double) { return 1.0; });
  Simulator simulator(*model, 0.002);
  ASSERT_TRUE(simulator.SetParameters(model->Nominal(), recording));
  std::vector<double> predicted(2 * 200);
  EXPECT_EQ(simulator.Run(recording, {0, 200}, AtRest(*model), predicted).outcome, Outcome::kDiverged);
  EXPECT_EQ(Predict(*model, recording, {}, nullptr, 1e-4)[0].size(), 200u);
}

TEST_F(SimulatorTest, AMotorSideThatRunsAwayBeforeTheWindowEndsTheRunThere) {
  const auto uses = ParseEffects({"joint_compliance@hinge"}, *model_->rig());
  ASSERT_TRUE(uses.ok());
  const auto model = MakeModel(experiment_, uses.value());
  const Recording recording = MakeRecording(experiment_, 400, 0.002, [](int, double) { return 1.0; });
  const std::string stiffness = "joint_compliance@hinge.stiffness_n_m_per_rad";
  const auto outcome = [&](double stiffness_n_m_per_rad) {
    std::vector<double> values = model->Nominal();
    values[static_cast<std::size_t>(model->IndexOf(stiffness))] = stiffness_n_m_per_rad;
    Simulator simulator(*model, 0.002);
    EXPECT_TRUE(simulator.SetParameters(values, recording));
    std::vector<double> predicted(2 * 100);
    return simulator.Run(recording, {300, 400}, AtRest(*model), predicted);
  };
  EXPECT_EQ(outcome(10).outcome, Outcome::kCompleted);
  // Both sides of 0.01 kg m^2 at 2 ms: a step of Runge and Kutta holds 2.8 rad of the oscillation, 1e4 N m/rad of it.
  const RunResult run = outcome(3e5);
  EXPECT_EQ(run.outcome, Outcome::kDiverged);
  EXPECT_EQ(run.diverged_at_s, recording.time_s[300]);
  EXPECT_EQ(run.steps, 0u);
}

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
  // It moves off at once, on a sensor whose resolution nobody states.
  for (std::size_t k = 0; k < recording.rows(); ++k)
    recording.measured[0].values[k] = 50 * std::pow(recording.time_s[k], 2) + (k % 2 == 0 ? 0 : 1e-4);
  EXPECT_LT(WorstAngle(Delayed(recording, "command_delay", delay_s)[0], Exact(recording, delay_s, 0)), 3e-5);
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

// A servo on every fourth stamp: its torque is that of the log's own target there, not of a mean over four.
TEST_F(SimulatorTest, ForcesFollowFinerCommands) {
  const Scratch scratch;
  const std::string yaml = R"(commands:
  - {actuator: motor, column: u, unit: rad}
measured:
  - {signal: q, column: q, joint: hinge, unit: rad}
  - {signal: w, column: w, kind: velocity, joint: hinge}
  - {signal: tau, column: tau, kind: torque, actuator: motor}
)";
  const Experiment experiment = MakeExperiment(
      scratch, Mjcf("damping=\"0.05\"", "<position name=\"motor\" joint=\"hinge\" kp=\"3\" kv=\"0.2\"/>"), yaml);
  const auto model = MakeModel(experiment);
  const Recording fine =
      MakeRecording(experiment, 801, 0.001, [](int, double t) { return 0.4 * std::sin(2 * M_PI * (1 + 9 * t) * t); });
  Recording coarse = fine;
  coarse.time_s.clear(), coarse.commands[0].values.clear();
  for (std::size_t k = 0; k < fine.rows(); k += 4) {
    coarse.time_s.push_back(fine.time_s[k]);
    double mean = 0;
    for (std::size_t i = k; i < std::min(k + 4, fine.rows()); ++i) mean += fine.commands[0].values[i] / 4;
    coarse.commands[0].values.push_back(mean);
  }
  for (auto& measured : coarse.measured) measured.values.assign(coarse.rows(), 0);
  coarse.finer = std::make_shared<const Recording>(fine);
  const auto exact = Predict(*model, fine), picked = Predict(*model, coarse);
  for (std::size_t k = 0; k + 1 < coarse.rows(); ++k) {
    const double target = fine.commands[0].values[k > 0 ? 4 * k - 1 : 0];
    ASSERT_NEAR(picked[2][k], 3 * (target - picked[0][k]) - 0.2 * picked[1][k], 1e-12) << k;
    ASSERT_NEAR(picked[2][k], exact[2][4 * k], 0.005 * Largest(exact[2])) << k;
  }
  // A part of the log finds its place in it.
  Recording part = coarse;
  part.start_s = 0.4;
  part.time_s.erase(part.time_s.begin() + 101, part.time_s.end());
  for (auto* values :
       {&part.commands[0].values, &part.measured[0].values, &part.measured[1].values, &part.measured[2].values})
    values->erase(values->begin(), values->begin() + 100);
  const auto later = Predict(*model, part);
  for (std::size_t k = 1; k < part.rows(); ++k)
    ASSERT_NEAR(later[2][k], 3 * (fine.commands[0].values[400 + 4 * k - 1] - later[0][k]) - 0.2 * later[1][k], 1e-12);
}

TEST_F(SimulatorTest, ATorqueIsTheOneBeforeTheStampsCommandActs) {
  const Scratch scratch;
  const std::string yaml = R"(commands:
  - {actuator: motor, column: u, unit: rad}
  - {actuator: feedforward, column: ff, unit: N m}
measured:
  - {signal: q, column: q, joint: hinge, unit: rad}
  - {signal: w, column: w, kind: velocity, joint: hinge}
  - {signal: tau, column: tau, kind: torque, actuator: motor}
)";
  const Experiment experiment = MakeExperiment(scratch,
                                               Mjcf("damping=\"0.05\"",
                                                    "<position name=\"motor\" joint=\"hinge\" kp=\"3\" "
                                                    "kv=\"0.2\"/><motor name=\"feedforward\" joint=\"hinge\"/>"),
                                               yaml);
  const auto model = MakeModel(experiment);
  const Recording recording = MakeRecording(experiment, 200, 0.002, [](int c, double t) {
    return c == 0 ? (std::fmod(t, 0.05) < 0.025 ? 0.4 : -0.4) : 0.1 * std::sin(40 * t);
  });
  const auto predicted = Predict(*model, recording);
  for (std::size_t k = 0; k < 200; ++k) {
    const std::size_t before = k > 0 ? k - 1 : 0;
    const double expected = 3 * (recording.commands[0].values[before] - predicted[0][k]) - 0.2 * predicted[1][k] +
                            recording.commands[1].values[before];
    ASSERT_NEAR(predicted[2][k], expected, 1e-12) << k;
  }
  // Reading a torque changes no motion.
  Experiment without = experiment;
  without.measured.pop_back();
  Recording same = recording;
  same.measured.pop_back();
  const auto motion = Predict(*MakeModel(without), same);
  EXPECT_EQ(motion[0], predicted[0]);
}

TEST_F(SimulatorTest, TheDrivesOwnEstimateIsReadWhereThereIsOne) {
  const Experiment joint = ShippedExperiment("joint");
  const auto base = MakeModel(joint);
  const Recording recording =
      MakeRecording(joint, 300, 0.002, [](int c, double t) { return c == 0 ? Exciting(t, 0.5) : 0; });
  const ScaleTable scales = EstimateScales(*base, {recording});
  const auto uses = ParseEffects({"torque_constant_droop"}, *base->rig());
  const auto model = MakeModel(joint, uses.value(), scales);
  const auto plain = Predict(*base, recording), neutral = Predict(*model, recording);
  EXPECT_LT(LargestDifference(plain[2], neutral[2]), 1e-9 * Largest(plain[2]));
  // With droop the estimate still is nominal torque constant times current: kp and kd of the motion, not the lesser
  // torque.
  const auto droop = Predict(*model, recording, {{uses.value()[0].Text() + ".loss_at_peak", 0.4}});
  for (std::size_t k = 1; k < 300; ++k)
    ASSERT_NEAR(droop[2][k], 157.1451 * (recording.commands[0].values[k - 1] - droop[0][k]) - 7.0729 * droop[1][k],
                1e-9)
        << k;
  EXPECT_GT(LargestDifference(droop[0], plain[0]), 1e-3);
}

}  // namespace
}  // namespace gapscope::testing
