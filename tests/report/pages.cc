#include "tests/report/pages.h"

#include <cmath>

#include "src/compare/comparison.h"
#include "src/report/replay_report.h"

namespace gapscope::testing {
namespace {

// As contract.md has it, with a name that would break a page that takes text for HTML.
const char* const kDiagnosis = R"({
  "schema": "gapscope.diagnosis/1", "verdict": "effects", "probability": 0.91,
  "effects": [
    {"name": "cable_spring", "on": "arm", "probability": 0.97, "parameters": {"stiffness_n_m_per_rad": {"value": 0.0012, "low": 0.0011, "high": 0.0013}},
     "error_before": 1.2, "error_after": 0.3, "share_of_gap": 0.8},
    {"name": "coulomb_friction", "on": "arm", "probability": 0.93, "parameters": {"friction_n_m": {"value": 0.0006, "low": 0.0005, "high": 0.0007}},
     "error_before": 0.3, "error_after": 0.01, "share_of_gap": 0.2}],
  "ambiguous": [], "gap": {"nominal": 1.77, "refit": 1.2, "final": 0.01, "floor": 0.008, "closed": 0.998, "held_out": true},
  "where": [{"signal": "arm_rad", "condition": "angle -0.8..-0.4 rad", "share_of_error": 0.6, "share_of_time": 0.1, "low": 0.5, "high": 0.7}],
  "candidates": [{"name": "cable_spring", "on": "arm", "probability": 0.97, "held_out_error": 0.3, "reason": "accepted: </script><b>held out</b>"},
                 {"name": "torque_bias", "on": "arm", "probability": 0.03, "held_out_error": 0.9, "reason": "does not bend with the angle"}],
  "next_experiment": {"command": "gapscope design triangle --seconds 20", "separates": ["cable_spring@arm", "gravity_offset@arm"]},
  "explanation": "Something pulls the arm towards one angle.", "logs": {"train": ["a"], "held_out": ["b"]}, "seed": 3,
  "versions": {"gapscope": "0.1.0", "mujoco": "4.0.1"}
})";

}  // namespace

std::unique_ptr<Page> DemoPage(const std::string& kind) {
  auto page = std::make_unique<Page>();
  const std::string root = GAPSCOPE_SOURCE_DIR;
  auto experiment = LoadExperiment(root + "/models/qube/experiment.yaml");
  GS_CHECK(experiment.ok());
  page->model = Model::Build(experiment.value(), {{"cable_spring", "arm"}}).value();
  page->recordings = {LoadRecording(experiment.value(), root + "/demo/qube.csv").value()};
  ThreadPool pool(1);
  std::vector<double> values = page->model->Nominal();
  page->result = nlohmann::ordered_json::parse(kDiagnosis);
  page->source = {.command_line = "gapscope diagnose models/qube/experiment.yaml demo/qube.csv",
                  .experiment = &page->model->experiment(),
                  .recordings = {&page->recordings.front()},
                  .held_out = {true},
                  .predictions = {},
                  .model = page->model.get(),
                  .values = values,
                  .parameters = page->model->parameters()};
  const ReplayResult nominal = Replay(*page->model, page->recordings, {.time_step_s = 0.002, .values = values}, pool);
  page->source.predictions.push_back({"nominal", nominal.logs});
  values[page->model->IndexOf("cable_spring@arm.stiffness_n_m_per_rad")] = 0.0012;
  page->source.predictions.push_back(
      {"diagnosed", Replay(*page->model, page->recordings, {.time_step_s = 0.002, .values = values}, pool).logs});
  if (kind == "replay") {
    page->result =
        ToJson(ReplayRunOf(*page->model, page->source.values, nominal, Compare(nominal, page->recordings, pool)));
    page->source.predictions.pop_back();
  }
  return page;
}

std::unique_ptr<Page> LongPage(std::size_t rows, std::size_t spike) {
  auto page = DemoPage("replay");
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
