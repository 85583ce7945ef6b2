#include "bench/case.h"

#include <cmath>
#include <map>
#include <numbers>

#include "src/experiment/experiment.h"

namespace gapscope::bench {
namespace {

struct RigSetting {
  double sample_s;                          // of its logs
  double amplitude;                         // of the sweep on the first command, SI
  std::map<std::string, double> constants;  // other commands
  std::map<std::string, double> log_values;
};

const std::map<std::string, RigSetting>& Settings() {
  static const std::map<std::string, RigSetting> settings = {
      {"joint", {0.002, 0.2, {}, {}}},
      {"qube", {0.002, 1.5, {}, {}}},
      {"flexjoint", {0.002, 2.0, {}, {}}},
      {"flexlink", {0.002, 0.3, {}, {}}},
      {"xl330",
       {0.0054,
        0.8,
        {{"motor.supply", 7.4}, {"motor.enable", 1}},
        {{"log.kp", 400}, {"log.mass", 0.49}, {"log.length", 0.1}, {"log.supply_v", 7.4}}}},
  };
  return settings;
}

// 0.3 to 5 Hz, linear.
double Sweep(double t, double duration_s) {
  constexpr double kFrom_hz = 0.3, kTo_hz = 5;
  return std::sin(2 * std::numbers::pi * (kFrom_hz + 0.5 * (kTo_hz - kFrom_hz) * t / duration_s) * t);
}

}  // namespace

std::vector<std::string> Rigs() { return {"joint", "qube", "flexjoint", "flexlink", "xl330"}; }

Result<Case> MakeCase(const std::string& rig, double duration_s) {
  const RigSetting& setting = Settings().at(rig);
  GS_ASSIGN(const Experiment experiment,
            LoadExperiment(std::string(GAPSCOPE_SOURCE_DIR) + "/models/" + rig + "/experiment.yaml"));
  Case made{.rig = rig};
  GS_ASSIGN(made.model, Model::Load(experiment));
  made.time_step_s = made.model->compiled().opt.timestep;
  made.values = made.model->Nominal();

  Recording recording;
  recording.log_path = rig;
  recording.values = setting.log_values;
  recording.timeline.median_step_s = setting.sample_s;
  for (int k = 0; k * setting.sample_s < duration_s + 0.5 * setting.sample_s; ++k)
    recording.time_s.push_back(k * setting.sample_s);
  for (const auto& spec : experiment.commands) {
    Recording::Command command{.actuator = spec.actuator, .column = "bench"};
    const auto constant = setting.constants.find(spec.actuator);
    for (const double t : recording.time_s) {
      const double swept = recording.commands.empty() ? setting.amplitude * Sweep(t, duration_s) : 0;
      command.values.push_back(constant != setting.constants.end() ? constant->second : swept);
    }
    recording.commands.push_back(std::move(command));
  }
  for (std::size_t i = 0; i < experiment.measured.size(); ++i) {
    if (experiment.measured[i].optional) continue;
    recording.measured.push_back({.spec = experiment.measured[i],
                                  .index = i,
                                  .column = "bench",
                                  .values = std::vector<double>(recording.rows(), 0.0)});
  }

  Simulator simulator(*made.model, made.time_step_s);
  const std::size_t signals = recording.measured.size();
  std::vector<double> predicted(recording.rows() * signals);
  simulator.SetParameters(made.values, recording);
  simulator.Run(recording, {0, recording.rows()}, InitialStateAt(*made.model, recording, 0, made.values), predicted);
  for (std::size_t k = 0; k < recording.rows(); ++k) {
    for (std::size_t s = 0; s < signals; ++s) recording.measured[s].values[k] = predicted[k * signals + s];
  }
  made.recordings.push_back(std::move(recording));
  return made;
}

}  // namespace gapscope::bench
