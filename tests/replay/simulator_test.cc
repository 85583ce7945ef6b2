// One recording through one model, against exact solutions.
#include "replay/simulator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/replay/disc.h"

namespace gapscope::testing {
namespace {

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
