// The loop closed in simulation: the law's arithmetic, balance, swing-up and catch, a cascade; and the real Qube's own
// law on its own log.
#include "replay/closed_loop.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "src/design/linear.h"
#include "tests/experiment/scratch.h"

namespace gapscope {
namespace {

constexpr double kPi = std::numbers::pi;
const std::string kModels = std::string(GAPSCOPE_SOURCE_DIR) + "/models/";

class ClosedLoopTest : public ::testing::Test {
 protected:
  // models/qube with a controller section, and a log that stands still at this pendulum angle.
  void Load(const std::string& controller, double pendulum_rad, double seconds, const std::string& columns = "",
            const std::string& cells = "") {
    std::string text = testing::ReadAll(kModels + "qube/experiment.yaml");
    text.replace(text.find("model: qube.xml"), 15, "model: " + kModels + "qube/qube.xml");
    const std::string path = scratch_.Write("experiment.yaml", text + controller);
    std::string log = "time_s,voltage_v,arm_rad,pendulum_rad" + columns + "\n";
    for (int k = 0; k <= seconds * 500; ++k)
      log += std::to_string(0.002 * k) + ",0,0," + std::to_string(pendulum_rad) + cells + "\n";
    auto experiment = LoadExperiment(path);
    ASSERT_TRUE(experiment.ok()) << experiment.error().Text();
    experiment_ = std::move(experiment).value();
    auto model = Model::Load(experiment_);
    ASSERT_TRUE(model.ok()) << model.error().Text();
    model_ = model.value();
    auto recording = LoadRecording(experiment_, scratch_.Write("log.csv", log));
    ASSERT_TRUE(recording.ok()) << recording.error().Text();
    recordings_ = {std::move(recording).value()};
  }
  Result<ClosedLoopResult> Run(const ReplayOptions& options = {}) {
    const auto spec = LoadController(experiment_);
    if (!spec.ok()) return spec.error();
    ThreadPool pool(1);
    return ReplayClosedLoop(*model_, recordings_, spec.value(), options, pool);
  }
  ReplayOptions LightArm() const {
    ReplayOptions options{.values = model_->Nominal()};
    options.values[model_->Find("arm.mass", "").value()] = 0.05;
    return options;
  }
  testing::Scratch scratch_;
  Experiment experiment_;
  std::shared_ptr<const Model> model_;
  std::vector<Recording> recordings_;
};

// State feedback about upright, where alpha = pi - pendulum is zero; gains as a term's keys.
std::string Upright(const std::string& theta, const std::string& alpha) {
  return R"(
controller:
  actuator: motor
  limit: 10
  inputs: [{name: theta, signal: arm_rad}, {name: alpha, signal: pendulum_rad, scale: -1, add: 3.141592653589793}]
  terms:
    - {input: theta, )" +
         theta + R"(, filter_rad_per_s: 50}
    - {input: alpha, )" +
         alpha + R"(, filter_rad_per_s: 50}
)";
}
// The law of the real balancing Qube: pi - pendulum is zero upright. Round the data sheet's arm (0.095 kg) it is
// unstable (poles 1.4 +- 14.9i); the rig's own arm is lighter.
const std::string kBalance = Upright("proportional: -6, derivative: -1.8", "proportional: -30, derivative: -2.5");

std::string Rows(const Eigen::MatrixXd& m) {
  std::string text = "[";
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    text += i > 0 ? ", [" : "[";
    for (Eigen::Index j = 0; j < m.cols(); ++j) text += (j > 0 ? ", " : "") + fmt::format("{:.17g}", m(i, j));
    text += "]";
  }
  return text + "]";
}

// LQR on the state of an observer, about upright: x is arm, pendulum - pi and their speeds.
std::string ObserverSection(const LinearSystem& system, const Eigen::MatrixXd& c, const Eigen::MatrixXd& gain,
                            const Eigen::MatrixXd& feedback, const std::string& inputs) {
  return "\ncontroller:\n  actuator: motor\n  limit: 10\n  inputs: [" + inputs +
         "]\n  observer:\n    a: " + Rows(system.a) +
         "\n    b: " + Rows(system.b.transpose()).substr(1, Rows(system.b.transpose()).size() - 2) +
         "\n    c: " + Rows(c) + "\n    gain: " + Rows(gain) +
         "\n    feedback: " + Rows(feedback).substr(1, Rows(feedback).size() - 2) + "\n";
}

TEST_F(ClosedLoopTest, KalmanFilterAndLuenbergerObserverBalanceTheQubeFromItsAngles) {
  Load(kBalance, kPi, 0.02);  // for the model alone
  const auto system = Linearize(*model_, model_->Nominal(), {}, {{"pendulum", kPi}}, 0);
  ASSERT_TRUE(system.ok()) << system.error().Text();
  const auto& [a, b, names] = system.value();
  const auto lqr = Lqr(a, b, Eigen::Vector4d(5, 30, 1, 1).asDiagonal(), Eigen::MatrixXd::Identity(1, 1));
  ASSERT_TRUE(lqr.ok());
  const std::string arm = "{name: theta, signal: arm_rad}",
                    pendulum = ", {name: alpha, signal: pendulum_rad, add: -3.141592653589793}";
  const Eigen::MatrixXd both = Eigen::MatrixXd::Identity(2, 4), one = Eigen::MatrixXd::Identity(1, 4);
  const Eigen::MatrixXd readings = 1e-6 * Eigen::MatrixXd::Identity(2, 2);  // 1 mrad counts at 500 Hz are of this order
  const auto kalman = KalmanGain(a, both, Eigen::Vector4d(0, 0, 1, 1).asDiagonal(), readings);
  ASSERT_TRUE(kalman.ok());
  const auto placed = ObserverGain(a, one, {{-40, 0}, {-45, 0}, {-50, 0}, {-55, 0}});
  ASSERT_TRUE(placed.ok());
  for (const auto& section :
       {ObserverSection(system.value(), both, kalman.value().gain, lqr.value().gain, arm + pendulum),
        ObserverSection(system.value(), one, placed.value().gain, lqr.value().gain, arm)}) {
    SCOPED_TRACE(section);
    // The arm alone shows the pendulum only through its push: it starts nearer upright.
    const double tilt = section.find("alpha") == std::string::npos ? 0.01 : 0.1;
    Load(section, kPi + tilt, 4);
    const auto result = Run();
    ASSERT_TRUE(result.ok()) << result.error().Text();
    const auto& log = result.value().result.logs[0];
    ASSERT_EQ(log.outcome, Outcome::kCompleted);
    for (std::size_t k = log.signals[1].predicted.size() / 2; k < log.signals[1].predicted.size(); ++k)
      ASSERT_NEAR(log.signals[1].predicted[k], kPi, 0.05) << k;
  }
}

TEST_F(ClosedLoopTest, ObserverFollowsTheLinearSystemExactly) {
  // x'' = 4 u - x, angle read: with readings of the true motion from the same start the estimate is that motion.
  ObserverSpec spec{.a = (Eigen::MatrixXd(2, 2) << 0, 1, -1, 0).finished(),
                    .c = (Eigen::MatrixXd(1, 2) << 1, 0).finished(),
                    .gain = (Eigen::MatrixXd(2, 1) << 1e-12, 1e-12).finished(),
                    .b = Eigen::Vector2d(0, 4),
                    .feedback = Eigen::Vector2d(3, 0.5)};
  Observer observer(spec);
  const double start[] = {0.2}, reference[] = {0.5};
  // At rest at the first reading; K (x - x_r) with x_r the least-norm state that reads the reference.
  EXPECT_NEAR(observer.Step(start, reference, 0, 0.01), 3 * 0.3, 1e-12);
  for (int k = 1; k <= 300; ++k) {
    const double t = 0.01 * k, angle[] = {2 + (0.2 - 2) * std::cos(t)};  // u = 0.5 holds the equilibrium at 2
    observer.Step(angle, reference, 0.5, 0.01);
    ASSERT_NEAR(observer.state()[0], angle[0], 1e-9) << k;
    ASSERT_NEAR(observer.state()[1], (2 - 0.2) * std::sin(t), 1e-9) << k;
  }
}

TEST_F(ClosedLoopTest, ALateSensorIsRefused) {
  Load(kBalance, kPi, 0.02);
  const auto late = Model::Build(model_->rig(), {{"sensor_delay", "arm_rad"}});
  ASSERT_TRUE(late.ok()) << late.error().Text();
  model_ = late.value();
  const auto result = Run();
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().Text().find("'arm_rad'"), std::string::npos) << result.error().Text();
}

TEST_F(ClosedLoopTest, AnObserverOfTheWrongSizeIsRefused) {
  for (const auto& [section, says] : std::vector<std::pair<std::string, std::string>>{
           {"observer: {a: [[0, 1], [0, 0]], b: [0, 1], c: [[1, 0]], gain: [[1, 2]], feedback: [1, 1]}",
            "'gain' is not a matrix"},
           {"observer: {a: [[0, 1]], b: [1], c: [[1]], gain: [[1]], feedback: [1]}", "'a' is not a matrix"},
           {"observer: {a: [[0]], c: [[1]], gain: [[1]], feedback: [1]}", "an observer needs"},
           {"observer: {a: [[0]], b: [1, 2], c: [[1]], gain: [[1]], feedback: [1]}", "'b' of 'observer'"}}) {
    Load("\ncontroller:\n  actuator: motor\n  inputs: [{name: theta, signal: arm_rad}]\n  " + section + "\n", 0, 0.02);
    const auto spec = LoadController(experiment_);
    ASSERT_FALSE(spec.ok()) << section;
    EXPECT_NE(spec.error().Text().find(says), std::string::npos) << spec.error().Text();
    EXPECT_NE(spec.error().Text().find("experiment.yaml:"), std::string::npos);
  }
}

TEST_F(ClosedLoopTest, LawIsTheBackwardDifferenceFormula) {
  Load(R"(
controller:
  actuator: motor
  limit: 2
  inputs: [{name: theta, signal: arm_rad}]
  references: {theta: wanted}
  feedforward: extra
  terms: [{input: theta, proportional: 3, integral: 5, derivative: 0.4, filter_rad_per_s: 50}]
)",
       0, 0.02, ",wanted,extra", ",0.25,0.5");
  const auto spec = LoadController(experiment_);
  ASSERT_TRUE(spec.ok()) << spec.error().Text();
  auto controller = Controller::Make(spec.value(), experiment_, recordings_[0]);
  ASSERT_TRUE(controller.ok()) << controller.error().Text();
  double last = 0, d = 0, integral = 0;
  for (std::size_t k = 0; k < 10; ++k) {
    const double reading = 0.01 * static_cast<double>(k), e = 0.25 - reading, readings[] = {reading, 0};
    d = (50 * (e - last) + d) / (1 + 50 * 0.002);
    integral += 5 * e * 0.002;
    last = e;
    const double law = 3 * e + integral + 0.4 * d;
    EXPECT_NEAR(controller.value().Step(k, readings), std::clamp(law + 0.5, -2.0, 2.0), 1e-13) << k;
    EXPECT_NEAR(controller.value().law(), law, 1e-13) << k;
  }
}

TEST_F(ClosedLoopTest, ThePendulumIsKeptUpright) {
  Load(kBalance, kPi - 0.08, 6);
  const auto closed = Run(LightArm());
  ASSERT_TRUE(closed.ok()) << closed.error().Text();
  const auto& log = closed.value().result.logs[0];
  EXPECT_EQ(log.outcome, Outcome::kCompleted);
  const auto& pendulum = log.signals[1].predicted;
  for (std::size_t k = 1500; k < pendulum.size(); ++k) ASSERT_NEAR(pendulum[k], kPi, 0.05) << k;
  // Round the heavier arm of the data sheet the same law loses it, and so does no controller at all.
  const auto heavy = Run();
  ASSERT_TRUE(heavy.ok());
  double lost = 0;
  for (const double q : heavy.value().result.logs[0].signals[1].predicted) lost = std::max(lost, std::abs(q - kPi));
  EXPECT_GT(lost, 0.5);
  ThreadPool pool(1);
  const auto open = Replay(*model_, recordings_, {.time_step_s = 0.002}, pool);
  double farthest = 0;
  for (const double q : open.logs[0].signals[1].predicted) farthest = std::max(farthest, std::abs(q - kPi));
  EXPECT_GT(farthest, 1.5);
  // The sensors' counts make it hunt: the command never settles to exactly zero, and stays inside the limit.
  double largest = 0;
  for (const double u : closed.value().sent[0]) largest = std::max(largest, std::abs(u));
  EXPECT_LE(largest, 10);
  // Statistics of the hunting.
  const MotionStatistics s = StatisticsOf(log.time_s, pendulum);
  EXPECT_NEAR(s.mean, kPi, 0.02);
}

// From rest to upright and held there; J = m (2 l)^2 / 3, m g l and the back-EMF of the rig's data sheet, LQR gains of
// `design lqr --at pendulum=3.14159 --q 10,10,1,10`.
const std::string kLqr =
    Upright("proportional: -3.1623, derivative: -2.008", "proportional: -59.4409, derivative: -6.0971");

class SwingUpTest : public ClosedLoopTest {
 protected:
  void ExpectHeldUpright(const std::string& swing_up) {
    Load(kLqr + swing_up, 0.0, 8);
    const auto closed = Run();
    ASSERT_TRUE(closed.ok()) << closed.error().Text();
    const LogReplay& log = closed.value().result.logs[0];
    double off = 0, arm = 0;
    for (std::size_t k = 0; k < log.time_s.size(); ++k) {
      arm = std::max(arm, std::abs(log.signals[0].predicted[k]));
      if (log.time_s[k] > 6) off = std::max(off, std::abs(std::remainder(log.signals[1].predicted[k] - kPi, 2 * kPi)));
    }
    EXPECT_LT(off, 0.02);
    EXPECT_LT(arm, 3.14);
    for (const double u : closed.value().sent[0]) ASSERT_LE(std::abs(u), 10);
  }
};

TEST_F(SwingUpTest, EnergyLawIsCaughtAndHeld) {
  ExpectHeldUpright(
      R"(  swing_up: {input: alpha, catch_rad: 0.35, drop_rad: 0.8, gain: -2000, inertia_kg_m2: 1.33e-4,
    torque_n_m: 0.01519, filter_rad_per_s: 200, limit: 6,
    arm: theta, arm_speed: 0.042, terms: [{input: theta, proportional: 8, derivative: 0.2, filter_rad_per_s: 50}]}
)");
}

TEST_F(SwingUpTest, StateFeedbackIsCaughtAndHeld) {
  ExpectHeldUpright(R"(  swing_up: {input: alpha, catch_rad: 0.35, drop_rad: 0.8,
    terms: [{input: alpha, derivative: -0.12, to: theta},
            {input: theta, proportional: 6, derivative: 0.3, filter_rad_per_s: 50}]}
)");
}

// Pumping while far from upright, the terms inside `catch_rad`, and on until `drop_rad` is passed.
TEST_F(ClosedLoopTest, CatchHasHysteresis) {
  Load(kBalance +
           "  swing_up: {input: alpha, catch_rad: 0.3, drop_rad: 0.6, gain: 100, inertia_kg_m2: 1.33e-4, torque_n_m: "
           "0.01519, limit: 1}\n",
       0.0, 0.1);
  const auto spec = LoadController(experiment_);
  ASSERT_TRUE(spec.ok()) << spec.error().Text();
  auto controller = Controller::Make(spec.value(), experiment_, recordings_[0]);
  ASSERT_TRUE(controller.ok());
  const std::pair<double, bool> walk[] = {{2.0, false},  {0.5, false}, {0.29, true}, {0.5, true},
                                          {0.61, false}, {0.5, false}, {-0.2, true}};
  std::size_t row = 0;
  for (const auto& [alpha, caught] : walk) {
    const double readings[] = {0, kPi - alpha}, sent = controller.value().Step(row++, readings);
    EXPECT_EQ(controller.value().caught(), caught) << alpha;
    if (!caught) {
      EXPECT_LE(std::abs(sent), 1) << alpha;
    }
  }
}

// Outside the arm's loop, inside nothing but its reference: the arm follows 20 s of a sine.
TEST_F(ClosedLoopTest, CascadeMovesTheInnerReference) {
  Load(R"(
controller:
  actuator: motor
  limit: 10
  inputs: [{name: theta, signal: arm_rad}, {name: phi, signal: pendulum_rad}]
  references: {theta: 0.3}
  terms:
    - {input: phi, proportional: 0.2, to: theta}
    - {input: theta, proportional: 8, derivative: 0.4}
)",
       0.3, 6);
  const auto closed = Run();
  ASSERT_TRUE(closed.ok()) << closed.error().Text();
  const auto& signals = closed.value().result.logs[0].signals;
  EXPECT_NEAR(signals[0].predicted.back(), 0.3, 0.02);
  EXPECT_NEAR(signals[1].predicted.back(), 0, 0.02);
}

// 12 ms of dead time are more than the loop's phase margin at its 17 rad/s allows.
TEST_F(ClosedLoopTest, ALateCommandLosesThePendulum) {
  Load(kBalance, kPi - 0.05, 6);
  const auto uses = ParseEffects({"command_delay@motor"}, *model_->rig());
  ASSERT_TRUE(uses.ok());
  model_ = Model::Build(model_->rig(), uses.value(), {}).value();
  const auto farthest = [&](double delay_s) {
    ReplayOptions options = LightArm();
    options.values[model_->Find("command_delay@motor.delay_s", "").value()] = delay_s;
    const auto closed = Run(options);
    EXPECT_TRUE(closed.ok());
    double far = 0;
    for (const double q : closed.value().result.logs[0].signals[1].predicted) far = std::max(far, std::abs(q - kPi));
    return far;
  };
  EXPECT_LT(farthest(0), 0.3);
  EXPECT_GT(farthest(0.012), 1);
}

// Two discs: the law holds the first one, the log drives the second, whose drive alone is late.
TEST_F(ClosedLoopTest, TheLogsOtherCommandsAreLateByTheirOwnDelay) {
  scratch_.Write("robot.xml", R"(<mujoco><option timestep="0.002" gravity="0 0 0"/><worldbody>
    <body><joint name="a" damping="0.05"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 0.02"/></body>
    <body><joint name="b" damping="0.05"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 0.02"/></body></worldbody>
    <actuator><motor name="first" joint="a"/><motor name="second" joint="b"/></actuator></mujoco>)");
  experiment_ = LoadExperiment(scratch_.Write("experiment.yaml", R"(model: robot.xml
log: {time: {column: time_s, unit: s}}
commands: [{actuator: first, column: u, unit: N m}, {actuator: second, column: v, unit: N m}]
measured: [{signal: a, column: a, joint: a, unit: rad}, {signal: b, column: b, joint: b, unit: rad}]
controller:
  {actuator: first, inputs: [{name: a, signal: a}], references: {a: 0.2}, terms: [{input: a, proportional: 0.5}]}
)"))
                    .value();
  const auto rig = Rig::Load(experiment_).value();
  const auto angles = [&](const std::vector<EffectUse>& effects, int late_rows) {
    std::string log = "time_s,u,v,a,b\n";
    for (int k = 0; k < 300; ++k)
      log += fmt::format("{},0,{},0,0\n", 0.002 * k, std::sin(0.1 * std::max(0, k - late_rows)));
    recordings_ = {LoadRecording(experiment_, scratch_.Write("log.csv", log)).value()};
    model_ = Model::Build(rig, effects).value();
    ReplayOptions options{.values = model_->Nominal()};
    if (!effects.empty()) options.values[model_->Find("command_delay@second.delay_s", "").value()] = 0.014;
    const auto closed = Run(options);
    EXPECT_TRUE(closed.ok()) << closed.error().Text();
    const auto& signals = closed.value().result.logs[0].signals;
    return std::pair(signals[0].predicted, signals[1].predicted);
  };
  const auto late = angles({{"command_delay", "second"}}, 0), shifted = angles({}, 7), on_time = angles({}, 0);
  EXPECT_EQ(late.first, on_time.first);
  EXPECT_EQ(late.second, shifted.second);
  EXPECT_NE(late.second, on_time.second);
}

TEST_F(ClosedLoopTest, BrokenSectionsAreRefused) {
  const std::pair<std::string, std::string> broken[] = {
      {"", "no controller is described"},
      {"controller: {actuator: brake, terms: []}\n", "without a command"},
      {"controller: {actuator: motor, inputs: [{name: a, signal: arm}], terms: []}\n", "not measured"},
      {"controller: {actuator: motor, inputs: [{name: a, signal: arm_rad}], terms: [{input: b}]}\n",
       "input that is not there"},
      {"controller: {actuator: motor, inputs: [{name: a, signal: arm_rad}]}\n", "neither 'terms'"},
      {"controller: {actuator: motor, limt: 3, inputs: [{name: a, signal: arm_rad}], terms: [{input: a}]}\n",
       "unknown key in 'controller'"},
      {"controller: {actuator: motor, inputs: [{name: a, signal: arm_rad}], references: {a: nowhere}, terms: [{input: "
       "a}]}\n",
       "neither a column"},
  };
  for (const auto& [section, says] : broken) {
    Load(section, 0, 0.1);
    const auto closed = Run();
    ASSERT_FALSE(closed.ok()) << section;
    EXPECT_NE(closed.error().Text().find(says), std::string::npos) << closed.error().Text();
  }
}

TEST(StatisticsTest, SineHasItsFrequencyAndSpread) {
  std::vector<double> t, x;
  for (int k = 0; k < 10000; ++k) t.push_back(0.001 * k), x.push_back(2 + 3 * std::sin(2 * kPi * 1.5 * t.back()));
  const MotionStatistics s = StatisticsOf(t, x);
  EXPECT_NEAR(s.mean, 2, 0.01);
  EXPECT_NEAR(s.deviation, 3 / std::sqrt(2.0), 0.01);
  EXPECT_NEAR(s.crossings_hz, 1.5, 0.11);
  EXPECT_NEAR(s.high, 5, 0.05);
}

// qube_koopman: the logged angles through the law give the logged voltage to 1e-12 V, and the loop closed round the
// simulated Qube keeps balancing.
TEST(RealClosedLoopTest, KoopmansLawIsReproduced) {
  const std::string folder = std::string(GAPSCOPE_SHARED_DATA) + "/qube_koopman/controller_20230828";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no real logs at " << folder;
  auto experiment = LoadExperiment(kModels + "qube_koopman/experiment.yaml");
  ASSERT_TRUE(experiment.ok()) << experiment.error().Text();
  Experiment whole = experiment.value();
  whole.replay.start_s = 0;  // from the program's start: its filters begin at zero
  const auto spec = LoadController(whole);
  ASSERT_TRUE(spec.ok()) << spec.error().Text();
  const auto model = Model::Load(experiment.value());
  ASSERT_TRUE(model.ok());
  std::size_t logs = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".csv") continue;
    ++logs;
    const auto recording = LoadRecording(whole, entry.path());
    ASSERT_TRUE(recording.ok());
    const auto log = ReadLog(entry.path(), whole.read);
    const auto* output = log.value().Find("control_output");
    ASSERT_NE(output, nullptr);
    auto controller = Controller::Make(spec.value(), whole, recording.value());
    ASSERT_TRUE(controller.ok()) << controller.error().Text();
    for (std::size_t k = 0; k < recording.value().rows(); ++k) {
      const double readings[] = {recording.value().measured[0].values[k], recording.value().measured[1].values[k]};
      const double sent = controller.value().Step(k, readings);
      ASSERT_NEAR(controller.value().law(), output->values[k], 1e-12) << entry.path() << " row " << k;
      ASSERT_NEAR(sent, recording.value().commands[0].values[k], 1e-12) << entry.path() << " row " << k;
    }
    const auto cut = LoadRecording(experiment.value(), entry.path());
    ASSERT_TRUE(cut.ok());
    ThreadPool pool(1);
    // The logs ask for a lighter arm than the data sheet's.
    std::vector<double> values = model.value()->Nominal();
    values[model.value()->Find("arm.mass", "").value()] = 0.04;
    const auto closed = ReplayClosedLoop(*model.value(), {cut.value()}, spec.value(), {.values = values}, pool);
    ASSERT_TRUE(closed.ok()) << closed.error().Text();
    const auto& signals = closed.value().result.logs[0].signals;
    EXPECT_EQ(closed.value().result.logs[0].outcome, Outcome::kCompleted);
    for (const double q : signals[1].predicted) ASSERT_NEAR(q, kPi, 0.5);  // it stays up for the whole log
    // It moves as much as the rig does: spreads within a quarter.
    for (const auto& signal : signals) {
      const double measured = StatisticsOf(cut.value().time_s, signal.measured).deviation,
                   predicted = StatisticsOf(cut.value().time_s, signal.predicted).deviation;
      EXPECT_NEAR(predicted / measured, 1, 0.25) << signal.signal << " " << entry.path();
    }
    EXPECT_NEAR(StatisticsOf(cut.value().time_s, closed.value().sent[0]).deviation /
                    StatisticsOf(cut.value().time_s, cut.value().commands[0].values).deviation,
                1, 0.25);
  }
  EXPECT_GT(logs, 0u);
}

}  // namespace
}  // namespace gapscope
