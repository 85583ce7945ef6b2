// Logs through a model: windows, workers, time step, a log against itself.
#include "replay/replay.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numeric>

#include "src/core/collect.h"
#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

// Begins at rest, as a log should: for 30 ms nothing is commanded.
Recording Log(const Model& model, double amplitude, int rows = 600, double step_s = 0.002) {
  return MakeRecording(model.experiment(), rows, step_s,
                       [=](int c, double t) { return c == 0 && t >= 0.03 ? Exciting(t, amplitude) : 0; });
}

// The log that the model itself would have made.
Recording OwnLog(const Model& model, double amplitude, double step_s, int rows = 600) {
  Recording recording = Log(model, amplitude, rows);
  const auto predicted = Predict(model, recording, {}, nullptr, step_s);
  for (std::size_t s = 0; s < predicted.size(); ++s) recording.measured[s].values = predicted[s];
  return recording;
}

bool SameBytes(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

TEST(MakeWindowsTest, CoverEveryRowOnce) {
  Recording r;
  for (int k = 0; k < 1001; ++k) r.time_s.push_back(k * 0.01);
  const auto free = MakeWindows(r, ReplayMode::kFreeRun, 1);
  ASSERT_EQ(free.size(), 1u);
  EXPECT_EQ(free[0].rows(), 1001u);
  const auto windows = MakeWindows(r, ReplayMode::kWindows, 1);
  ASSERT_EQ(windows.size(), 10u);
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(windows[i].begin, 100 * i);
    EXPECT_EQ(windows[i].end, 100 * i + 101);  // the next one starts on this one's last row
  }
  // 10 s in windows of 3 s: the rest of 1 s is too short and joins the last one.
  const auto three = MakeWindows(r, ReplayMode::kWindows, 3);
  ASSERT_EQ(three.size(), 3u);
  EXPECT_EQ(three.back().begin, 600u);
  EXPECT_EQ(three.back().end, 1001u);
  // Longer than the log, and shorter than a sample.
  EXPECT_EQ(MakeWindows(r, ReplayMode::kWindows, 100).size(), 1u);
  EXPECT_EQ(MakeWindows(r, ReplayMode::kWindows, 1e-6).size(), 1000u);
  // A gap longer than a window.
  Recording gap;
  gap.time_s = {0, 0.1, 0.2, 5, 5.1, 5.2};
  std::size_t covered = 0;
  for (const Window& w : MakeWindows(gap, ReplayMode::kWindows, 0.2)) {
    EXPECT_GE(w.rows(), 2u);
    EXPECT_EQ(w.begin, covered);
    covered = w.end - 1;
  }
  EXPECT_EQ(covered, 5u);
}

class OwnLogTest : public ::testing::TestWithParam<const char*> {};

TEST_P(OwnLogTest, ReplaysWithoutError) {
  const auto model = MakeModel(ShippedExperiment(GetParam()));
  const double step_s = model->compiled().opt.timestep;
  const Recording log = OwnLog(*model, 0.5, step_s);
  ThreadPool pool(1);
  const ReplayResult replay = Replay(*model, {log}, {.time_step_s = step_s}, pool);
  EXPECT_EQ(replay.logs[0].outcome, Outcome::kCompleted);
  // From rest at the initial pose the log's own first row is the initial state, to the bit.
  EXPECT_EQ(ReplayError(replay.logs), 0);
  for (const SignalTrace& signal : replay.logs[0].signals)
    EXPECT_TRUE(SameBytes(signal.measured, signal.predicted)) << signal.signal;
  EXPECT_EQ(replay.steps, static_cast<std::size_t>(std::lround(599 * 0.002 / step_s)));
  EXPECT_NEAR(replay.simulated_s, 599 * 0.002, 1e-12);
  // Windows start from a local fit of the log: small errors, no more.
  const ReplayResult windows =
      Replay(*model, {log}, {.mode = ReplayMode::kWindows, .window_s = 0.2, .time_step_s = step_s}, pool);
  EXPECT_EQ(windows.logs[0].windows, 6u);
  constexpr double kWindowStart = 0.1;  // a window may begin amid a step of the command, which the fit smooths
  EXPECT_LT(ReplayError(windows.logs), kWindowStart);
  EXPECT_TRUE(std::isnan(windows.logs[0].signals[0].predicted[0]))
      << "a window's first row says nothing about the model";
}

INSTANTIATE_TEST_SUITE_P(Rigs, OwnLogTest, ::testing::Values("joint", "qube", "flexjoint", "flexlink"),
                         [](const auto& test) { return std::string(test.param); });

TEST(ReplayTest, SameBytesForAnyNumberOfWorkers) {
  const auto model = MakeModel(ShippedExperiment("qube"));
  std::vector<Recording> logs;
  for (const double amplitude : {0.3, 0.6, 1.1}) {
    logs.push_back(Log(*model, amplitude, 300 + static_cast<int>(100 * amplitude)));
    for (std::size_t k = 0; k < logs.back().rows(); ++k) {
      logs.back().measured[0].values[k] = 0.1 * std::sin(0.02 * static_cast<double>(k));
      logs.back().measured[1].values[k] = 0.2 * std::cos(0.05 * static_cast<double>(k));
    }
  }
  for (const ReplayMode mode : {ReplayMode::kFreeRun, ReplayMode::kWindows}) {
    std::vector<ReplayResult> results;
    for (const int jobs : {1, 2, 7}) {
      ThreadPool pool(jobs);
      results.push_back(Replay(*model, logs, {.mode = mode, .window_s = 0.05}, pool));
    }
    for (std::size_t i = 1; i < results.size(); ++i) {
      EXPECT_EQ(results[i].time_step_s, results[0].time_step_s);
      EXPECT_EQ(results[i].time_step_error, results[0].time_step_error);
      EXPECT_EQ(results[i].steps, results[0].steps);
      for (std::size_t l = 0; l < logs.size(); ++l) {
        for (std::size_t s = 0; s < 2; ++s)
          EXPECT_TRUE(SameBytes(results[i].logs[l].signals[s].predicted, results[0].logs[l].signals[s].predicted));
      }
    }
  }
}

TEST(ReplayTest, ADivergedLogDoesNotSpoilTheOthers) {
  const auto model = MakeModel(ShippedExperiment("qube"));
  Recording good = OwnLog(*model, 0.5, 0), bad = good;
  for (double& u : bad.commands[0].values) u = 1e12;
  ThreadPool pool(2);
  const ReplayResult replay = Replay(*model, {bad, good}, {.time_step_s = model->compiled().opt.timestep}, pool);
  EXPECT_EQ(replay.logs[0].outcome, Outcome::kDiverged);
  EXPECT_EQ(replay.logs[0].diverged_windows, 1u);
  EXPECT_EQ(replay.logs[1].outcome, Outcome::kCompleted);
  EXPECT_EQ(ReplayError({replay.logs[1]}), 0);
  EXPECT_TRUE(std::isinf(ReplayError(replay.logs)));
}

TEST(ReplayTest, ParametersThatMakeNoModelAreADivergence) {
  const auto model = MakeModel(ShippedExperiment("qube"));
  const Recording log = OwnLog(*model, 0.5, 0);
  std::vector<double> values = model->Nominal();
  values[static_cast<std::size_t>(model->IndexOf("motor.resistance"))] = 0;
  ThreadPool pool(1);
  const ReplayResult replay = Replay(*model, {log}, {.time_step_s = 0.002, .values = values}, pool);
  EXPECT_EQ(replay.logs[0].outcome, Outcome::kDiverged);
  EXPECT_TRUE(std::isnan(replay.logs[0].signals[0].predicted[10]));
}

TEST(ReplayErrorTest, HandNumbers) {
  LogReplay log;
  log.signals.push_back({.signal = "a", .measured = {0, 2, 0, 2}, .predicted = {1, 3, 1, 3}});  // RMSE 1, deviation 1
  log.signals.push_back({.signal = "b", .measured = {0, 4, 0, 4}, .predicted = {0, 4, 0, 4}});  // 0
  log.signals.push_back({.signal = "c", .scored = false, .measured = {0, 1, 0, 1}, .predicted = {9, 9, 9, 9}});
  EXPECT_DOUBLE_EQ(ReplayError({log}), std::sqrt(0.5));
  log.signals[1].predicted = {NAN, 6, 2, NAN};  // two rows of error 2, deviation 2
  EXPECT_DOUBLE_EQ(ReplayError({log}), 1);
  LogReplay exact = log;
  for (auto& signal : exact.signals) signal.predicted = signal.measured;
  EXPECT_DOUBLE_EQ(ReplayError({log, exact}), std::sqrt(0.5));
  EXPECT_TRUE(std::isnan(ReplayError({})));
  log.outcome = Outcome::kDiverged;
  EXPECT_TRUE(std::isinf(ReplayError({log})));
}

Experiment SpringRig(const Scratch& scratch, const char* integrator, double stiffness, double step_s) {
  return MakeExperiment(
      scratch,
      "<mujoco><option timestep=\"" + std::to_string(step_s) + "\" gravity=\"0 0 0\" integrator=\"" + integrator +
          "\"><flag contact=\"disable\"/></option><worldbody><body><joint name=\"hinge\" axis=\"0 0 1\" "
          "damping=\"0.02\" stiffness=\"" +
          std::to_string(stiffness) +
          "\"/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"0.02 0.02 0.02\"/></body></worldbody><actuator><motor "
          "name=\"motor\" joint=\"hinge\"/></actuator></mujoco>",
      "commands:\n  - {actuator: motor, column: u, unit: N m}\nmeasured:\n  - {signal: q, column: q, joint: hinge, "
      "unit: rad}\n");
}

// A spring of 2 N m/rad, 0.02 kg m^2 and 0.02 N m s/rad under 1 N m from rest, as it moves in closed form.
class StepKindTest : public ::testing::TestWithParam<const char*> {
 protected:
  StepKindTest()
      : experiment_(SpringRig(scratch_, GetParam(), 2, 0.002)),
        model_(MakeModel(experiment_)),
        log_(MakeRecording(experiment_, 500, 0.002, [](int, double) { return 1.0; })) {}

  std::vector<double> Predicted(StepKind steps, double step_s) {
    Simulator simulator(*model_, step_s);
    simulator.set_steps(steps);
    EXPECT_TRUE(simulator.SetParameters(model_->Nominal(), log_));
    std::vector<double> predicted(log_.rows());
    EXPECT_EQ(simulator.Run(log_, {0, log_.rows()}, AtRest(*model_), predicted).outcome, Outcome::kCompleted);
    return predicted;
  }
  double Error(StepKind steps, double step_s) {
    const double rate = 0.02 / (2 * 0.02), turning = std::sqrt(2 / 0.02 - rate * rate);
    const std::vector<double> exact = Collect(log_.time_s, [&](double t) {
      return 0.5 * (1 - std::exp(-rate * t) * (std::cos(turning * t) + rate / turning * std::sin(turning * t)));
    });
    return LargestDifference(Predicted(steps, step_s), exact);
  }
  Scratch scratch_;
  Experiment experiment_;
  std::shared_ptr<const Model> model_;
  Recording log_;
};

TEST_P(StepKindTest, AFirstOrderIntegratorIsExactToSecondOrder) {
  const double own = Error(StepKind::kOwn, 0.002), plain = Error(StepKind::kPlain, 0.002);
  EXPECT_NEAR(plain / Error(StepKind::kPlain, 0.001), 2, 0.1);
  EXPECT_NEAR(own / Error(StepKind::kOwn, 0.001), 4, 0.2);
  EXPECT_LT(own, 0.05 * plain);
}

// What remains of it: a third of the work, and the first order's error.
TEST_P(StepKindTest, QuickMakesWholeStepsAlone) {
  EXPECT_TRUE(model_->HasQuickSteps());
  EXPECT_NEAR(Error(StepKind::kQuick, 0.002) / Error(StepKind::kQuick, 0.001), 2, 0.1);
}

// A servo's damping of 20 N m s/rad on 0.02 kg m^2 is gone in a millisecond: Euler's steps of 4 ms run away, and so do
// those of a plugin in its place, whose forces are explicit in speed.
class StiffServoTest : public ::testing::Test {
 protected:
  Outcome Run(const std::vector<EffectUse>& effects, StepKind steps, double* last) {
    const auto model = MakeModel(experiment_, effects);
    Simulator simulator(*model, 0.004);
    simulator.set_steps(steps);
    EXPECT_TRUE(simulator.SetParameters(model->Nominal(), log_));
    std::vector<double> predicted(log_.rows());
    const RunResult run = simulator.Run(log_, {0, log_.rows()}, AtRest(*model), predicted);
    *last = predicted.back();
    return run.outcome;
  }
  Scratch scratch_;
  Experiment experiment_ = MakeExperiment(
      scratch_,
      "<mujoco><worldbody><body><joint name=\"hinge\"/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"0.02 0.02 "
      "0.02\"/></body></worldbody><actuator><position name=\"servo\" joint=\"hinge\" kp=\"200\" "
      "kv=\"20\"/></actuator></mujoco>",
      "commands:\n  - {actuator: servo, column: u, unit: rad}\nmeasured:\n  - {signal: q, column: q, joint: hinge, "
      "unit: rad}\n");
  Recording log_ = MakeRecording(experiment_, 50, 0.004, [](int, double) { return 0.1; });
};

TEST_F(StiffServoTest, ItsDampingIsBorne) {
  // The poles of 0.02 s^2 + 20 s + 200.
  const double slow = (20 - std::sqrt(20 * 20 - 4 * 0.02 * 200)) / (2 * 0.02), fast = 20 / 0.02 - slow;
  const double t = log_.time_s.back();
  const double exact = 0.1 * (1 - (fast * std::exp(-slow * t) - slow * std::exp(-fast * t)) / (fast - slow));
  for (const std::vector<EffectUse>& effects : {std::vector<EffectUse>(), {{"dead_zone", "servo"}}}) {
    double last = 0;
    EXPECT_EQ(Run(effects, StepKind::kOwn, &last), Outcome::kCompleted);
    EXPECT_NEAR(last, exact, 1e-4 * exact);
    EXPECT_EQ(Run(effects, StepKind::kPlain, &last), Outcome::kDiverged);
  }
}

INSTANTIATE_TEST_SUITE_P(Integrators, StepKindTest, ::testing::Values("Euler", "implicitfast", "implicit"));

class ChooseTimeStepTest : public ::testing::Test {
 protected:
  TimeStep Choose(const Experiment& experiment, double wrong, double step_s = 0.002, int rows = 400) {
    model_ = MakeModel(experiment);
    log_ = MakeRecording(experiment, rows, step_s, [](int, double t) { return t >= 0.03 ? Exciting(t, 0.3) : 0; });
    const auto predicted = Predict(*model_, log_, {}, nullptr, 1e-4);
    for (std::size_t k = 0; k < log_.rows(); ++k) log_.measured[0].values[k] = wrong * predicted[0][k];
    return ChooseTimeStep(*model_, {log_}, {}, pool_);
  }
  double ErrorAt(double step_s) { return ReplayError(Replay(*model_, {log_}, {.time_step_s = step_s}, pool_).logs); }
  Scratch scratch_;
  std::shared_ptr<const Model> model_;
  Recording log_;
  ThreadPool pool_{1};
};

TEST_F(ChooseTimeStepTest, AHigherOrderNeedsNoHalving) {
  const TimeStep rk4 = Choose(SpringRig(scratch_, "RK4", 2, 0.002), 1.1);
  EXPECT_EQ(rk4.step_s, 0.002);
  EXPECT_LT(rk4.error_change, 0.01 * ErrorAt(rk4.step_s));
}

TEST_F(ChooseTimeStepTest, AFirstOrderIntegratorNeedsNoHalvingEither) {
  const TimeStep euler = Choose(SpringRig(scratch_, "Euler", 20, 0.002), 1.02);
  EXPECT_EQ(euler.step_s, 0.002);
}

TEST_F(ChooseTimeStepTest, AFastModelIsHalvedUntilTheErrorIsItsOwn) {
  const TimeStep euler = Choose(SpringRig(scratch_, "Euler", 500, 0.002), 1.02);
  EXPECT_LT(euler.step_s, 0.002);
  EXPECT_GE(euler.step_s, 0.002 / 32);
  EXPECT_EQ(euler.error_change, std::abs(ErrorAt(euler.step_s) - ErrorAt(euler.step_s / 2)));
}

TEST_F(ChooseTimeStepTest, AModelStepLongerThanTheSamplesHidesNothing) {
  // 10 ms in the MJCF, 2 ms in the log: halving 10 ms to 5 ms changes no step that is taken.
  const TimeStep coarse = Choose(SpringRig(scratch_, "Euler", 500, 0.01), 1.02);
  EXPECT_LT(coarse.step_s, 0.002);
}

TEST_F(ChooseTimeStepTest, ASlowLogGoesDownToTheModelsOwnStep) {
  // 24 rad/s in samples of 160 ms: RK4 is unstable at 160 and at 80 ms, sound at 2 ms.
  const TimeStep slow = Choose(SpringRig(scratch_, "RK4", 50, 0.002), 1.1, 0.16, 100);
  EXPECT_TRUE(std::isfinite(ErrorAt(slow.step_s)));
  EXPECT_LT(slow.error_change, 0.01 * ErrorAt(slow.step_s / 2));
}

TEST(EstimateScalesTest, TheRigsOwnSize) {
  const auto model = MakeModel(ShippedExperiment("joint"));
  const Recording log = OwnLog(*model, 0.5, 0);
  const ScaleTable table = EstimateScales(*model, {log});
  ASSERT_TRUE(table.contains("joint") && table.contains("motor"));
  const Scales& s = table.at("joint");
  EXPECT_NEAR(s.inertia_kg_m2, 0.159221308, 1e-9);
  EXPECT_NEAR(s.angle_rad, Largest(log.measured[0].values), 0.05);
  EXPECT_NEAR(s.speed_rad_per_s, Largest(log.measured[1].values), 0.2 * Largest(log.measured[1].values));
  EXPECT_NEAR(s.torque_n_m, Largest(log.measured[2].values), 0.5 * Largest(log.measured[2].values));
  EXPECT_NEAR(s.sample_s, 0.002, 1e-12);
  EXPECT_NEAR(table.at("motor").command, Largest(log.commands[0].values), 1e-12);
}

}  // namespace
}  // namespace gapscope::testing
