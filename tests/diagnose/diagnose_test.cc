// The diagnosis on logs of the independent twin plant (tests/twin), whose cause is known here and not to the program.
// The full blind check is scripts/blind_check.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>

#include "src/diagnose/diagnosis.h"
#include "tests/twin/case.h"
#include "tests/twin/output.h"

namespace gapscope {
namespace {

// A case of the twin, its logs bound to the rig's experiment: `count` of its six, for the time.
struct Logs {
  Experiment experiment;
  std::vector<Recording> recordings;
  std::vector<twin::EffectLabel> effects;
};

Logs MakeLogs(const std::string& rig, twin::Kind kind, const std::string& effect, std::uint64_t seed,
              std::uint64_t index = 0, std::size_t count = 3) {
  twin::Case c;
  std::string problem;
  twin::CaseRequest request;
  request.seed = seed;
  request.index = index;
  request.kind = kind;
  request.rig = rig;
  request.effect = effect;
  EXPECT_TRUE(twin::MakeCase(request, &c, &problem)) << problem;
  Logs logs;
  auto experiment = LoadExperiment(GAPSCOPE_SOURCE_DIR "/models/" + rig + "/experiment.yaml");
  EXPECT_TRUE(experiment.ok());
  logs.experiment = experiment.value();
  logs.effects = c.effects;
  const std::string folder = ::testing::TempDir() + "diagnose_" + std::to_string(::getpid());
  for (const auto& record : twin::MakeRecords(c, true)) {
    if (logs.recordings.size() == count) break;
    const std::string path = folder + "/log_" + std::to_string(logs.recordings.size()) + ".csv";
    EXPECT_TRUE(twin::WriteText(path, twin::CsvText(record), &problem)) << problem;
    auto recording = LoadRecording(logs.experiment, path);
    EXPECT_TRUE(recording.ok());
    logs.recordings.push_back(std::move(recording).value());
  }
  std::filesystem::remove_all(folder);
  return logs;
}

const DiagnoseOptions kQuick{.effort = SearchEffort::kQuick};

// Without the design of a next experiment, which none of these tests reads.
Diagnosis DiagnoseLogs(const Logs& logs, DiagnoseOptions options = {}) {
  options.next_experiment = false;
  ThreadPool pool(2);
  auto result = Diagnose(logs.experiment, SplitData(logs.recordings, {}), options, pool);
  EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().Text());
  // No work is too much for what could stand in the place of what was found: only time can cut that.
  EXPECT_EQ(std::ranges::count(result.value().cut, "exchange"), 0);
  for (const Statement& there : result.value().statements) {
    if (there.answer != Answer::kPresent) continue;
    // What is told rests on nothing that is not.
    if (there.sets) EXPECT_EQ(there.sets->with.effects, result.value().model->effects());
    for (const Statement& s : result.value().statements)
      EXPECT_TRUE(s.use != there.use || s.answer == Answer::kPresent) << s.use.Text() << " is told as absent too";
  }
  return std::move(result).value();
}

// Error on one of the logs by the model with its parameters tuned to the others.
double TunedWithout(const Logs& logs, std::size_t left_out, const Model& model, const std::vector<double>& values) {
  DataSplit split{.held_out = {logs.recordings[left_out]}};
  for (std::size_t l = 0; l < logs.recordings.size(); ++l) {
    if (l != left_out) split.train.push_back(logs.recordings[l]);
  }
  ThreadPool pool(2);
  const TuneOptions options{.objective = ObjectiveKind::kWindows, .starts = 1};
  const auto tuned = Tune(model, split, values, options, pool);
  EXPECT_TRUE(tuned.ok());
  return ReplayError(Evaluate(model, split.held_out, {tuned.value().values, tuned.value().stamps}, ReplayMode::kWindows,
                              options, pool));
}

TEST(DiagnoseTest, NamesATorqueBias) {
  const Logs logs = MakeLogs("flexlink", twin::Kind::kSingle, "torque_bias@hub", 31);
  const Diagnosis d = DiagnoseLogs(logs);
  ASSERT_EQ(d.verdict, Verdict::kEffects) << d.explanation;
  ASSERT_EQ(d.effects.size(), 1u);
  EXPECT_EQ(d.effects[0].use.Text(), "torque_bias@hub");
  EXPECT_GT(d.probability, 0.5);
  // The scale common to all torques is only known from the nominal values, to +-20 %.
  const double truth = logs.effects[0].parameters.front().second;
  EXPECT_NEAR(d.effects[0].parameters[0].value / truth, 1, 0.25);
  EXPECT_LT(d.final, 0.3 * d.refit);
  EXPECT_GT(d.closed, 0.8);
  ASSERT_EQ(d.by_log.size(), logs.recordings.size());
  // One of those that were fitted, left out. A tune weighs signals otherwise, which tells where much is missing.
  const auto left_out = std::find_if(d.by_log.begin(), d.by_log.end(),
                                     [&](const LogGap& gap) { return gap.log == logs.recordings[0].log_path; });
  ASSERT_NE(left_out, d.by_log.end());
  EXPECT_NEAR(left_out->refit / TunedWithout(logs, 0, *d.refit_model, d.refit_values), 1, 0.2);
  EXPECT_NEAR(left_out->final / TunedWithout(logs, 0, *d.model, d.values), 1, 0.1);
  double sum = 0;
  for (const auto& c : d.candidates) sum += c.probability;
  EXPECT_NEAR(sum, 1, 1e-9);
}

TEST(DiagnoseTest, WhatIsKnownIsInTheBaseModel) {
  const Logs logs = MakeLogs("flexlink", twin::Kind::kSingle, "torque_bias@hub", 31);
  const EffectUse known{"torque_bias", "hub"};
  const Diagnosis d = DiagnoseLogs(logs, {.effort = SearchEffort::kQuick, .known = {known}});
  EXPECT_TRUE(d.effects.empty()) << d.explanation;
  EXPECT_TRUE(std::none_of(d.statements.begin(), d.statements.end(), [&](const auto& s) { return s.use == known; }));
  const int size = d.refit_model->IndexOf("torque_bias@hub.torque_n_m");
  ASSERT_GE(size, 0);
  const double truth = logs.effects[0].parameters.front().second;
  EXPECT_NEAR(d.refit_values[static_cast<std::size_t>(size)] / truth, 1, 0.25);
  EXPECT_LT(d.refit, 0.3 * d.nominal);
}

TEST(DiagnoseTest, WhatTheBudgetDidNotReachIsNotAbsent) {
  const Logs logs = MakeLogs("flexlink", twin::Kind::kSingle, "torque_bias@hub", 31);
  ThreadPool pool(2);
  const auto d =
      Diagnose(logs.experiment, SplitData(logs.recordings, {}), {.budget_s = 1e-3, .next_experiment = false}, pool);
  ASSERT_TRUE(d.ok()) << d.error().Text();
  const auto found = std::ranges::find(d.value().statements, EffectUse{"torque_bias", "hub"}, &Statement::use);
  ASSERT_NE(found, d.value().statements.end());
  EXPECT_EQ(found->answer, Answer::kUnseen);
  EXPECT_EQ(found->rule, kNotTried);
  EXPECT_NE(d.value().explanation.find("was not tried"), std::string::npos) << d.value().explanation;
}

TEST(DiagnoseTest, NamesATorqueSpeedCurve) {
  const Logs logs = MakeLogs("qube", twin::Kind::kSingle, "torque_speed_curve@motor", 32);
  const Diagnosis d = DiagnoseLogs(logs);
  ASSERT_FALSE(d.effects.empty()) << d.explanation;
  EXPECT_EQ(d.effects[0].use.Text(), "torque_speed_curve@motor") << d.explanation;
  // The power from which the torque falls; the scale common to all torques is only known to +-20 %.
  ASSERT_EQ(logs.effects.size(), 1u);
  EXPECT_NEAR(d.effects[0].parameters[0].value / logs.effects[0].parameters.front().second, 1, 0.25);
}

TEST(DiagnoseTest, NamesNothingWhereNothingIsMissing) {
  const Diagnosis d = DiagnoseLogs(MakeLogs("flexjoint", twin::Kind::kNone, "", 33));
  EXPECT_TRUE(d.verdict == Verdict::kNone || d.verdict == Verdict::kParameters) << d.explanation;
  EXPECT_TRUE(d.effects.empty());
  // Parameters that are the answer are named.
  EXPECT_EQ(d.verdict == Verdict::kParameters, d.explanation.find("Retuning moves") != std::string::npos)
      << d.explanation;
}

// A cable and dry friction: each alone bends to do what the other one does, and fails on the windows that were held
// out.
TEST(DiagnoseTest, NamesTwoEffectsThatFailAlone) {
  const Diagnosis d = DiagnoseLogs(MakeLogs("flexlink", twin::Kind::kAuto, "", 913, 19), kQuick);
  ASSERT_EQ(d.verdict, Verdict::kEffects) << d.explanation;
  ASSERT_EQ(d.effects.size(), 2u);
  std::vector<std::string> names = {d.effects[0].use.Text(), d.effects[1].use.Text()};
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names[0], "cable_spring@hub");
  EXPECT_EQ(names[1], "coulomb_friction@hub");
}

// A sensor that is off by a constant changes no motion: free runs, too, find the constant. They are of the retuned
// model, whatever effort goes into effects.
TEST(DiagnoseTest, FreeRunsFindZeroOffsets) {
  Logs logs = MakeLogs("qube", twin::Kind::kNone, "", 35, 0, 1);
  const Diagnosis as_logged = DiagnoseLogs(logs, kQuick);
  for (auto& recording : logs.recordings) {
    for (auto& measured : recording.measured) {
      if (measured.spec.on != "pendulum") continue;
      for (double& value : measured.values) value += 0.1;
    }
  }
  const Diagnosis off = DiagnoseLogs(logs, kQuick);
  EXPECT_NEAR(off.evidence.free_run_before / as_logged.evidence.free_run_before, 1, 0.1);
}

// Commands that have nothing to do with the motion: no effect may be named with confidence.
TEST(DiagnoseTest, ShuffledCommandsAreNoEffect) {
  Logs logs = MakeLogs("flexlink", twin::Kind::kNone, "", 34, 0, 1);
  std::mt19937_64 random(5);
  for (auto& recording : logs.recordings)
    std::shuffle(recording.commands[0].values.begin(), recording.commands[0].values.end(), random);
  const Diagnosis d = DiagnoseLogs(logs, kQuick);
  EXPECT_EQ(d.verdict, Verdict::kUnknown) << d.explanation;
}

}  // namespace
}  // namespace gapscope
