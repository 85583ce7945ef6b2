#include "tests/report/pages.h"

#include <fmt/core.h>

#include <cmath>

#include "src/compare/comparison.h"
#include "src/core/statistics.h"
#include "src/report/explain_report.h"
#include "src/report/replay_report.h"
#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

const EffectUse kSpring{"cable_spring", "arm"}, kFriction{"coulomb_friction", "arm"}, kGravity{"gravity_offset", "arm"};

FoundEffect Found(const EffectUse& use, const EffectEstimate& size, double probability, double before, double after,
                  double share) {
  return {.use = use,
          .probability = probability,
          .parameters = {size},
          .error_before = before,
          .error_after = after,
          .share_of_gap = share};
}

// The demo log and the model with a cable spring, nominal: without it.
std::unique_ptr<Page> BarePage() {
  auto page = std::make_unique<Page>();
  const std::string root = GAPSCOPE_SOURCE_DIR;
  auto experiment = LoadExperiment(root + "/models/qube/experiment.yaml");
  GS_CHECK(experiment.ok());
  page->model = Model::Build(Rig::Load(experiment.value()).value(), {kSpring}).value();
  page->recordings = {LoadRecording(experiment.value(), root + "/demo/qube.csv").value()};
  page->source.command_line = "gapscope diagnose models/qube/experiment.yaml demo/qube.csv";
  page->source.experiment = &page->model->experiment();
  page->source.recordings = {&page->recordings.front()};
  page->source.held_out = {true};
  page->source.model = page->model.get();
  page->source.values = page->model->Nominal();
  page->source.parameters = page->model->parameters();
  return page;
}

ReplayResult Replayed(const Page& page, const std::vector<double>& values) {
  ThreadPool pool(1);
  return Replay(*page.model, page.recordings, {.time_step_s = 0.002, .values = values}, pool);
}

}  // namespace

DiagnoseRun MadeDiagnosis(Verdict verdict) {
  Diagnosis d;
  d.verdict = verdict;
  d.probability = 0.91;
  d.nominal = 1.77, d.refit = 1.2, d.final = 0.01, d.floor = 0.008, d.closed = 0.998;
  d.by_log = {{"logs/one.csv", 1.2, 0.1, 0.05, 0, 20}, {"logs/two.csv", kInfinity, 0.3, 0.05, 0, 20}};
  if (verdict != Verdict::kEffects && verdict != Verdict::kAmbiguous) {
    d.final = d.refit;
  } else {
    d.effects = {Found(kSpring, {"stiffness_n_m_per_rad", "N m/rad", 0.0012, 0.0011, 0.0013}, 0.97, 0.9, 0.01, 0.8),
                 Found(kFriction, {"friction_n_m", "N m", 0.0006, 0.0005, 0.0007}, 0.93, 0.3, 0.01, 0.2)};
  }
  for (const FoundEffect& found : d.effects) {
    d.statements.push_back({.use = found.use,
                            .answer = gapscope::Answer::kPresent,
                            .probability = found.probability,
                            .parameters = found.parameters,
                            .share_of_gap = {.value = found.share_of_gap},
                            .rule = "its own evidence: </script><b>bold</b>"});
    d.statements.back().numbers.gain = 1.5;
  }
  if (verdict == Verdict::kAmbiguous) {
    d.ambiguous = {{kSpring, kGravity}};
    d.statements.front().group = 0;
    d.statements.push_back({.use = kGravity, .answer = gapscope::Answer::kPresent, .probability = 0.97, .group = 0});
  }
  d.statements.push_back({.use = {"torque_bias", "arm"},
                          .answer = gapscope::Answer::kAbsent,
                          .probability = 0.03,
                          .bounds = {{"torque_n_m", "N m", 0.0002, 0.0002, 0.0002}},
                          .rule = "gains too little"});
  d.remainder = {.explained = 0.9, .systematic = 0.07, .sensors = 0.03, .not_repeatable = NAN, .reachable = 0.95};
  d.where = {{.signal = "arm_rad",
              .condition = "angle -0.8..-0.4 rad",
              .share_of_error = 0.6,
              .share_of_time = 0.1,
              .low = 0.5,
              .high = 0.7}};
  d.evidence.floors_left = 3;
  d.remains = d.where;
  d.remains[0].condition = "speed 4..9 rad/s";
  d.candidates = {
      {.effect = kSpring, .probability = 0.97, .held_out_error = 0.3, .reason = "accepted: </script><b>held out</b>"},
      {.effect = EffectUse{"torque_bias", "arm"},
       .probability = 0.03,
       .held_out_error = 0.9,
       .reason = "does not bend with the angle"}};
  d.next = {.why = NextExperiment::Why::kTogether,
            .separates = {kSpring, kGravity},
            .probability = 0.48,
            .if_present = 0.9,
            .if_absent = 0.1,
            .input_csv = "time_s,voltage_v\n0,0\n",
            .command = "gapscope design triangle models/qube/experiment.yaml --duration 20"};
  d.explanation = "Something pulls the arm towards one angle.";
  d.train_logs = {"a"}, d.held_out_logs = {"b"};
  return {.info = {.seed = 3}, .diagnosis = std::move(d)};
}

std::unique_ptr<Page> ReplayPage() {
  auto page = BarePage();
  ReplayResult nominal = Replayed(*page, page->source.values);
  page->source.predictions = {{"nominal", nominal.logs}};
  ThreadPool pool(1);
  Comparison comparison = Compare(*page->model->rig(), nominal, page->recordings, pool);
  const ReplayRun run = ReplayRunOf(*page->model, page->source.values, std::move(nominal), std::move(comparison));
  page->result = ToJson(run);
  page->source.content = PageOf(run);
  return page;
}

std::unique_ptr<Page> DiagnosisPage(Verdict verdict) {
  auto page = BarePage();
  DiagnoseRun run = MadeDiagnosis(verdict);
  run.diagnosis.model = page->model;
  run.diagnosis.values = page->source.values;
  run.diagnosis.values[page->model->IndexOf("cable_spring@arm.stiffness_n_m_per_rad")] = 0.0012;
  page->source.predictions = {{"nominal", Replayed(*page, page->source.values).logs},
                              {"diagnosed", Replayed(*page, run.diagnosis.values).logs}};
  page->source.curves = {{"cable spring on arm",
                          {.joint = "arm",
                           .at = {-0.5, 0, 0.5},
                           .missing_n_m = {0.0006, 0.0001, -0.0005},
                           .low_n_m = {0.0004, -0.0001, -0.0008},
                           .high_n_m = {0.0008, 0.0002, -0.0003},
                           .effect_n_m = {0.0006, 0, -0.0006}}}};
  page->result = ToJson(run);
  page->source.content = PageOf(run);
  return page;
}

std::unique_ptr<Page> ExplanationPage() {
  auto page = BarePage();
  ExplainRun run{
      .diagnosis = "out", .number = 1, .statement = MadeDiagnosis(Verdict::kEffects).diagnosis.statements[0]};
  run.statement.numbers = {.gain = 1.5, .gain_held_out = 0.7, .gain_free = kNaN, .discrepancy = 30, .clear = 4};
  run.statement.sets = std::make_shared<const ComparedSets>(
      ComparedSets{.with = {}, .without = {}, .blocks = {{"logs/a.csv", 1, 1.5, 0.8}, {"logs/a.csv", 0, 0.5, 0.2}}});
  run.statement.rivals = {{kGravity, 0.6}};
  page->source.predictions = {{"without it", Replayed(*page, page->source.values).logs}};
  page->result = ToJson(run);
  page->source.content = PageOf(run);
  return page;
}

std::unique_ptr<Page> ManyPage(int joints, int rows) {
  auto page = std::make_unique<Page>();
  std::string bodies, actuators, commands, measured;
  for (int k = 0; k < joints; ++k) {
    const std::string name = fmt::format("joint_{:02}", k);
    bodies += fmt::format("<body pos='0 {} 1'><joint name='{}' axis='0 1 0'/><geom size='0.02' pos='0 0 -0.2'/></body>",
                          0.1 * k, name);
    actuators += fmt::format("  - {{name: {0}, joint: {0}, kind: position, kp: 5, kd: 0.2}}\n", name);
    commands += fmt::format("  - {{actuator: {0}, column: {0}_target, unit: rad}}\n", name);
    measured += fmt::format("  - {{signal: {0}, column: {0}_pos, joint: {0}, unit: rad}}\n", name);
  }
  const Scratch scratch;
  const Experiment experiment =
      MakeExperiment(scratch, "<mujoco><worldbody>" + bodies + "</worldbody></mujoco>",
                     "actuators:\n" + actuators + "commands:\n" + commands + "measured:\n" + measured);
  page->model = MakeModel(experiment);
  page->recordings = {
      MakeRecording(experiment, rows, 0.005, [](int c, double t) { return std::sin((1 + 0.1 * c) * t); })};
  Recording& recording = page->recordings.front();
  LogReplay replay = EmptyTraces(recording);
  for (std::size_t s = 0; s < recording.measured.size(); ++s) {
    std::vector<double>& values = recording.measured[s].values;
    for (std::size_t r = 0; r < values.size(); ++r) {
      values[r] = recording.commands[s].values[r] + 1e-3 * std::sin(37.0 * static_cast<double>(r * (s + 1)));
      replay.signals[s].predicted.resize(values.size());
      replay.signals[s].predicted[r] = (1 - 0.02 * static_cast<double>(s)) * values[r];
    }
    replay.signals[s].measured = values;
  }
  ReplayResult result{.time_step_s = 0.005, .logs = {replay}};
  page->source = {.command_line = "gapscope replay",
                  .experiment = &page->model->experiment(),
                  .recordings = {&page->recordings.front()},
                  .predictions = {{"nominal", {replay}}},
                  .model = page->model.get(),
                  .values = page->model->Nominal(),
                  .parameters = page->model->parameters()};
  ThreadPool pool(2);
  Comparison comparison = Compare(*page->model->rig(), result, page->recordings, pool);
  const ReplayRun run = ReplayRunOf(*page->model, page->source.values, std::move(result), std::move(comparison));
  page->result = ToJson(run);
  page->table = ToTable(run);
  page->source.content = PageOf(run);
  return page;
}

std::unique_ptr<Page> LongPage(std::size_t rows, std::size_t spike) {
  auto page = ReplayPage();
  Recording& recording = page->recordings.front();
  LogReplay& replay = page->source.predictions.front().logs.front();
  recording.time_s.resize(rows);
  for (std::size_t r = 0; r < rows; ++r) recording.time_s[r] = 1e-3 * static_cast<double>(r);
  const auto wave = [&](double phase) {
    std::vector<double> values(rows);
    for (std::size_t r = 0; r < rows; ++r)
      values[r] = std::sin(1e-4 * static_cast<double>(r) + phase) + 0.05 * std::sin(0.7 * static_cast<double>(r));
    return values;
  };
  for (auto& command : recording.commands) command.values = wave(1);
  for (std::size_t s = 0; s < recording.measured.size(); ++s) {
    recording.measured[s].values = wave(0);
    replay.signals[s].measured = recording.measured[s].values;
    replay.signals[s].predicted = wave(0.1);
  }
  recording.measured.front().values[spike] = 9.75;
  replay.time_s = recording.time_s;
  return page;
}

}  // namespace gapscope::testing
