// Limits kept by rehearsal, and inputs chosen by what they show: against closed forms and fits that are simple enough
// to reason about.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <sstream>

#include "src/design/optimal.h"
#include "src/fit/policy.h"
#include "tests/experiment/scratch.h"

namespace gapscope {
namespace {

const std::string kModels = std::string(GAPSCOPE_SOURCE_DIR) + "/models/";

struct Rig {
  Experiment experiment;
  std::shared_ptr<const Model> model;
};
// `free`: every other parameter is frozen; empty: as the experiment has it.
Rig Load(const std::string& name, const std::string& free = "") {
  const auto experiment = LoadExperiment(kModels + name + "/experiment.yaml");
  EXPECT_TRUE(experiment.ok()) << experiment.error().Text();
  Rig rig{.experiment = WithLimitSignals(experiment.value())};
  for (auto& p : rig.experiment.parameters) p.frozen = p.frozen || (!free.empty() && p.name != free);
  const auto model = Model::Load(rig.experiment);
  EXPECT_TRUE(model.ok()) << model.error().Text();
  rig.model = model.value();
  return rig;
}

Hypothesis NominalOf(const Rig& rig) { return {.name = "none", .model = rig.model, .values = rig.model->Nominal()}; }

std::vector<double> Wave(WaveShape shape, double low, double high, double rate) {
  return SampleWaveform({.shape = shape, .duration_s = 5, .low_hz = low, .high_hz = high, .seed = 1}, rate).value();
}

// The flexible joint is linear: what is reached grows with the amplitude, so the largest safe amplitude puts the worst
// limit at the margin.
TEST(RehearsalTest, LargestAmplitudeUsesTheMarginOnALinearRig) {
  const Rig rig = Load("flexjoint");
  Simulator simulator(*rig.model, 0);
  const RehearsalOptions options{.rate_hz = 500};
  const auto wave = Wave(WaveShape::kSquare, 1 / 0.63, 1, 500);
  const auto amplitude =
      LargestAmplitude({{rig.model.get(), &simulator, rig.model->Nominal()}}, options, wave, 10, 0.9);
  ASSERT_TRUE(amplitude.ok());
  std::vector<double> values = wave;
  for (double& v : values) v *= amplitude.value();
  auto input = MakeInput(rig.experiment, options, values);
  ASSERT_TRUE(input.ok());
  const Rehearsal rehearsal = Rehearse(*rig.model, simulator, input.value(), rig.model->Nominal());
  EXPECT_LE(rehearsal.worst, 0.9 * (1 + 1e-6));
  EXPECT_GT(rehearsal.worst, 0.85);
  ASSERT_EQ(rehearsal.extremes.size(), 4u);
  EXPECT_EQ(rehearsal.extremes[0].name, "motor command");
  EXPECT_DOUBLE_EQ(rehearsal.extremes[0].reached, amplitude.value());
}

// At standstill the servo's first torque is kp times the step: 119.6 / 157.1451 rad is all that the torque limit
// allows.
TEST(RehearsalTest, TorqueLimitOfAStepIsTheServosStiffness) {
  const Rig rig = Load("joint");
  Simulator simulator(*rig.model, 0);
  std::vector<double> step(500, 0.0);
  for (std::size_t k = 50; k < step.size(); ++k) step[k] = 1;
  const auto amplitude =
      LargestAmplitude({{rig.model.get(), &simulator, rig.model->Nominal()}}, {.rate_hz = 500}, step, 1.6, 1);
  ASSERT_TRUE(amplitude.ok());
  // Torque is read at the stamps: one sample (2 ms) after the step it is a few percent lower.
  EXPECT_GE(amplitude.value(), 119.6 / 157.1451 * 0.95);
  EXPECT_LE(amplitude.value(), 119.6 / 157.1451 * 1.15);
}

// Against a bias the motor has to give that torque at standstill: R / kt volts a newton metre. The nominal model, which
// has no bias, is driven without it.
TEST(RehearsalTest, AConstantCommandHoldsTheRigAgainstABias) {
  const Rig rig = Load("qube");
  constexpr double kBias_n_m = 1e-4;
  const EffectUse bias{"torque_bias", "arm"};
  const auto model = Model::Build(rig.model->rig(), {bias}, {{"arm", {.torque_n_m = 0.01, .angle_rad = 1}}});
  ASSERT_TRUE(model.ok()) << model.error().Text();
  std::vector<double> values = model.value()->Nominal();
  values[static_cast<std::size_t>(model.value()->IndexOf("torque_bias@arm.torque_n_m"))] = kBias_n_m;
  Simulator simulator(*model.value(), 0), nominal(*rig.model, 0);
  RehearsalOptions options{.rate_hz = 200};
  const auto held = HoldingCommand({{model.value().get(), &simulator, values}}, options, 8);
  ASSERT_TRUE(held.ok()) << held.error().Text();
  EXPECT_NEAR(held.value(), -kBias_n_m * 8.4 / 0.042, 1e-4);
  const auto none = HoldingCommand({{rig.model.get(), &nominal, rig.model->Nominal()}}, options, 8);
  ASSERT_TRUE(none.ok());
  EXPECT_EQ(none.value(), 0);

  options.offset = held.value();
  const auto input = MakeInput(rig.experiment, options, std::vector<double>(1601, 0.0));
  ASSERT_TRUE(input.ok());
  const Rehearsal of_nominal =
      Rehearse(*rig.model, nominal, input.value(), rig.model->Nominal(), {.command = 0, .value = options.offset});
  EXPECT_EQ(of_nominal.extremes[0].reached, std::abs(options.offset));
  EXPECT_LT(of_nominal.extremes[1].reached, 1e-9);
  EXPECT_LT(Rehearse(*model.value(), simulator, input.value(), values).extremes[1].reached, 0.02);
}

TEST(RehearsalTest, CsvIsALogOfTheExperiment) {
  const Rig rig = Load("flexjoint");
  Simulator simulator(*rig.model, 0);
  std::vector<double> values = Wave(WaveShape::kTriangle, 0.5, 1, 100);
  auto input = MakeInput(rig.experiment, {.rate_hz = 100}, values);
  ASSERT_TRUE(input.ok());
  const std::string csv =
      InputCsv(rig.experiment, Rehearse(*rig.model, simulator, input.value(), rig.model->Nominal()));
  testing::Scratch scratch;
  const std::string path = scratch.Write("input.csv", csv);
  const auto log = ReadLog(path, rig.experiment.read);
  ASSERT_TRUE(log.ok()) << log.error().Text();
  ASSERT_NE(log.value().Find("voltage_v"), nullptr);
  ASSERT_NE(log.value().Find("predicted.base_rad"), nullptr);
  EXPECT_EQ(log.value().Find("voltage_v")->values.size(), values.size());
  EXPECT_NEAR(log.value().Find("voltage_v")->values[37], values[37], 1e-9);
  // No measured column: nobody can mistake a prediction for a log.
  EXPECT_EQ(log.value().Find("base_rad"), nullptr);
}

TEST(RehearsalTest, RefusesUnknownActuatorsAndMissingNumbers) {
  const Rig rig = Load("flexjoint"), servo = Load("xl330");
  EXPECT_FALSE(
      MakeInput(rig.experiment, {.actuator = "moter", .hold = {}, .log_values = {}, .rate_hz = 100}, {0, 0}).ok());
  EXPECT_FALSE(
      MakeInput(rig.experiment, {.actuator = "", .hold = {{"brake", 1}}, .log_values = {}, .rate_hz = 100}, {0, 0})
          .ok());
  const auto missing = MakeInput(servo.experiment, {.rate_hz = 100}, {0, 0});
  ASSERT_FALSE(missing.ok());
  EXPECT_NE(missing.error().Text().find("--value log.kp"), std::string::npos);
}

// The flexible joint is linear: a quarter of the amplitude has a sixteenth of the information, so four times the
// standard deviation, or a little less where what is known beforehand of shift and zeros helps.
TEST(OptimalTest, DeviationsGrowAsTheAmplitudeShrinks) {
  const Rig rig = Load("flexjoint", "link.stiffness");
  ThreadPool pool(1);
  const Hypothesis base = NominalOf(rig);
  const auto design = DesignForParameters(base, {rig.model->IndexOf("link.stiffness")},
                                          {.rehearsal = {.rate_hz = 250}, .duration_s = 4}, pool);
  ASSERT_TRUE(design.ok()) << design.error().Text();
  const auto& inputs = design.value().inputs;
  ASSERT_GE(inputs.size(), 5u);
  std::map<double, double> chirps;  // deviation by amplitude
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    EXPECT_LE(inputs[i].rehearsal.worst, 0.9 * (1 + 1e-6));
    ASSERT_EQ(inputs[i].per_target.size(), 1u);
    EXPECT_NEAR(inputs[i].score, -std::log(inputs[i].per_target[0]), 1e-12);
    if (i > 0) {
      EXPECT_GE(inputs[i].per_target[0], inputs[i - 1].per_target[0]);
    }
    if (inputs[i].wave.shape == WaveShape::kChirp) chirps[inputs[i].amplitude] = inputs[i].per_target[0];
  }
  ASSERT_EQ(chirps.size(), 2u);
  const auto [small, large] = std::pair{*chirps.begin(), *chirps.rbegin()};
  EXPECT_NEAR(large.first / small.first, 4, 1e-9);
  EXPECT_LE(small.second / large.second, 4 * (1 + 1e-6));
  EXPECT_GT(small.second / large.second, 3.5);

  const auto frozen =
      DesignForParameters(NominalOf(Load("qube")), {0, 3}, {.rehearsal = {.rate_hz = 250}, .duration_s = 3}, pool);
  EXPECT_FALSE(frozen.ok());
}

// Torque constant over resistance, inertias, dampings and stiffness scale together unseen: no input tells the stiffness
// better than that common factor was known beforehand, whatever its amplitude.
TEST(OptimalTest, CommonFactorIsKnownNoBetterThanBeforehand) {
  const Rig rig = Load("flexjoint");
  ThreadPool pool(2);
  const auto design = DesignForParameters(NominalOf(rig), {rig.model->IndexOf("link.stiffness")},
                                          {.rehearsal = {.rate_hz = 250}, .duration_s = 4}, pool);
  ASSERT_TRUE(design.ok()) << design.error().Text();
  double information = 0;
  for (const char* name :
       {"motor.resistance", "motor.kt", "base.inertia", "base.damping", "link.inertia", "link.damping"}) {
    const Parameter& p = rig.model->parameters()[static_cast<std::size_t>(rig.model->IndexOf(name))];
    information += std::pow(kFitPolicy.known_share * std::log(p.high / p.low), -2);
  }
  const double beforehand = 1 / std::sqrt(information);
  EXPECT_GE(design.value().inputs.front().per_target[0], beforehand * 0.99);
  EXPECT_LE(design.value().inputs.front().per_target[0], beforehand * 2);
}

// A bias and a spring about a far rest angle look alike as long as the arm hardly moves: the chosen input moves it.
TEST(OptimalTest, SeparatingInputMovesWhereTheRivalsDiffer) {
  const Rig rig = Load("flexjoint");
  ThreadPool pool(2);
  const ScaleTable scales;
  const auto rival = [&](const std::string& effect, const std::map<std::string, double>& set) {
    const auto uses = ParseEffects({effect}, *rig.model->rig());
    const auto model = Model::Build(rig.model->rig(), uses.value(), scales);
    EXPECT_TRUE(model.ok());
    std::vector<double> values = model.value()->Nominal();
    for (const auto& [name, value] : set) values[model.value()->Find(name, "").value()] = value;
    return Hypothesis{.name = effect, .model = model.value(), .values = values};
  };
  const Hypothesis base = NominalOf(rig);
  const std::vector<Hypothesis> rivals = {
      rival("cable_spring@base",
            {{"cable_spring@base.stiffness_n_m_per_rad", 0.02}, {"cable_spring@base.rest_rad", 0.3}}),
      rival("torque_bias@base", {{"torque_bias@base.torque_n_m", 0.006}}),
  };
  const OptimalOptions options{.rehearsal = {.rate_hz = 250}, .duration_s = 2.5};
  const auto design = DesignForRivals(base, rivals, options, pool);
  ASSERT_TRUE(design.ok()) << design.error().Text();
  const auto& inputs = design.value().inputs;
  ASSERT_EQ(design.value().targets.size(), 2u);
  EXPECT_GT(inputs.front().score, 5);
  // The same choice with any number of workers.
  ThreadPool one(1);
  const auto again = DesignForRivals(base, rivals, options, one);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again.value().inputs.front().amplitude, inputs.front().amplitude);
  EXPECT_EQ(again.value().inputs.front().score, inputs.front().score);
  // A bias beside no effect: the bias shows, and that nothing is there needs no input, as a bias of zero does as well.
  const auto there = DesignForRivals(base, {rivals[1], base}, options, pool);
  ASSERT_TRUE(there.ok());
  const InputScore& best = there.value().inputs.front();
  EXPECT_EQ(best.per_target[1], 0);
  EXPECT_EQ(best.score, best.per_target[0]);
  EXPECT_GT(best.score, 1);
  // In windows that begin where the log is, a bias has less time to bend the motion than over the whole log.
  Simulator simulator(*rivals[1].model, 0);
  const Recording log = Rehearse(*rivals[1].model, simulator, best.rehearsal.recording, rivals[1].values).recording;
  const double in_windows = ForetoldFit(base, {log, FloorsOf(log), 0.5}).Misfit(4);
  EXPECT_GT(in_windows, 0);
  EXPECT_LT(in_windows, 0.5 * best.score);
  // The command makes the same input.
  EXPECT_NE(CommandFor("rig.yaml", options.rehearsal, best).find(" --amplitude "), std::string::npos);
  // A rival can imitate itself: what is left against a copy is nothing.
  const auto copy = DesignForRivals(base, {rivals[0], rivals[0]}, options, pool);
  ASSERT_TRUE(copy.ok());
  EXPECT_LT(copy.value().inputs.front().score, 1e-6);
}

}  // namespace
}  // namespace gapscope
