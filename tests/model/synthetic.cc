#include "tests/model/synthetic.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gapscope::testing {

Experiment MakeExperiment(const Scratch& scratch, const std::string& mjcf, const std::string& yaml) {
  scratch.Write("robot.xml", mjcf);
  const auto loaded = LoadExperiment(scratch.Write("experiment.yaml", "model: robot.xml\n" + yaml));
  EXPECT_TRUE(loaded.ok()) << loaded.error().Text();
  return loaded.ok() ? loaded.value() : Experiment{};
}

Experiment ShippedExperiment(const std::string& rig) {
  const auto loaded = LoadExperiment(std::string(GAPSCOPE_SOURCE_DIR) + "/models/" + rig + "/experiment.yaml");
  EXPECT_TRUE(loaded.ok()) << loaded.error().Text();
  return loaded.ok() ? loaded.value() : Experiment{};
}

Recording MakeRecording(const Experiment& experiment, int rows, double step_s,
                        const std::function<double(int, double)>& command,
                        const std::map<std::string, double>& values) {
  Recording recording;
  recording.log_path = "synthetic";
  recording.values = values;
  for (int k = 0; k < rows; ++k) recording.time_s.push_back(k * step_s);
  for (std::size_t c = 0; c < experiment.commands.size(); ++c) {
    Recording::Command column{.actuator = experiment.commands[c].actuator, .column = "synthetic", .values = {}};
    for (const double t : recording.time_s) column.values.push_back(command(static_cast<int>(c), t));
    recording.commands.push_back(std::move(column));
  }
  for (std::size_t i = 0; i < experiment.measured.size(); ++i) {
    recording.measured.push_back({.spec = experiment.measured[i],
                                  .index = i,
                                  .column = "synthetic",
                                  .values = std::vector<double>(recording.rows(), 0.0)});
  }
  recording.timeline.time_s = recording.time_s;
  recording.timeline.median_step_s = recording.timeline.shortest_step_s = recording.timeline.longest_step_s = step_s;
  return recording;
}

std::shared_ptr<const Model> MakeModel(const Experiment& experiment, const std::vector<EffectUse>& effects,
                                       const ScaleTable& scales) {
  const auto rig = Rig::Load(experiment);
  EXPECT_TRUE(rig.ok()) << rig.error().Text();
  if (!rig.ok()) return nullptr;
  const auto built = Model::Build(rig.value(), effects, scales);
  EXPECT_TRUE(built.ok()) << built.error().Text();
  return built.ok() ? built.value() : nullptr;
}

std::vector<double> ValuesWith(const Model& model, const std::map<std::string, double>& set) {
  std::vector<double> values = model.Nominal();
  for (const auto& [name, value] : set) {
    const int index = model.IndexOf(name);
    EXPECT_GE(index, 0) << name;
    if (index >= 0) values[static_cast<std::size_t>(index)] = value;
  }
  return values;
}

std::vector<std::vector<double>> Predict(const Model& model, const Recording& recording,
                                         const std::map<std::string, double>& set, const InitialState* start,
                                         double max_step_s) {
  Simulator simulator(model, max_step_s);
  EXPECT_TRUE(simulator.SetParameters(ValuesWith(model, set), recording));
  const std::size_t signals = recording.measured.size();
  std::vector<double> flat(recording.rows() * signals);
  const RunResult run = simulator.Run(recording, {0, recording.rows()}, start ? *start : AtRest(model), flat);
  EXPECT_EQ(run.outcome, Outcome::kCompleted) << "diverged at " << run.diverged_at_s;
  std::vector<std::vector<double>> predicted(signals);
  for (std::size_t s = 0; s < signals; ++s) {
    for (std::size_t r = 0; r < recording.rows(); ++r) predicted[s].push_back(flat[r * signals + s]);
  }
  return predicted;
}

double LargestDifference(const std::vector<double>& a, const std::vector<double>& b) {
  EXPECT_EQ(a.size(), b.size());
  double largest = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    if (!(std::abs(a[i] - b[i]) <= largest)) largest = std::abs(a[i] - b[i]);
  }
  return largest;
}

double Largest(const std::vector<double>& a) { return LargestDifference(a, std::vector<double>(a.size(), 0.0)); }

double Exciting(double t_s, double amplitude, double from_hz, double to_hz) {
  constexpr double kDuration_s = 2;
  const double phase = 2 * std::numbers::pi * (from_hz * t_s + 0.5 * (to_hz - from_hz) / kDuration_s * t_s * t_s);
  return amplitude * (0.7 * std::sin(phase) + (std::fmod(t_s, 0.8) < 0.4 ? 0.3 : -0.3));
}

}  // namespace gapscope::testing
