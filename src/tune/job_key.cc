#include "src/tune/job_key.h"

#include <vector>

namespace gapscope {

namespace {

// Effects of the experiment's own, which models of the same run will have.
void AddCandidates(const Experiment& experiment, Hasher* hasher) {
  for (const OwnEffect& own : experiment.candidates) {
    hasher->Text(own.name).Text(own.joint).Text(own.torque);
    for (const FieldSetting& setting : own.settings) {
      hasher->Text(setting.field);
      for (const auto& expression : setting.expressions) hasher->Text(expression);
    }
    for (const OwnParameter& p : own.parameters) {
      const double role = p.role ? static_cast<double>(*p.role) : -1;
      const double numbers[] = {p.neutral, p.low, p.high, p.start, role};
      hasher->Text(p.key).Numbers(numbers).Numbers(p.trials);
    }
  }
  for (const SwitchedOff& off : experiment.without) hasher->Text(off.effect).Text(off.on);
}

}  // namespace

void AddModel(const Model& model, Hasher* hasher) {
  const mjModel& compiled = model.compiled();
  std::vector<char> bytes(static_cast<std::size_t>(mj_sizeModel(&compiled)));
  mj_saveModel(&compiled, nullptr, bytes.data(), static_cast<int>(bytes.size()));
  hasher->Bytes(bytes.data(), bytes.size());
  for (const Parameter& p : model.parameters()) {
    const double numbers[] = {p.nominal, p.low, p.high, p.frozen ? 1.0 : 0.0, static_cast<double>(p.with)};
    hasher->Text(p.name).Text(p.size).Numbers(numbers);
  }
  const Experiment& experiment = model.experiment();
  for (const FieldSetting& setting : experiment.settings) {
    hasher->Text(setting.field);
    for (const auto& expression : setting.expressions) hasher->Text(expression);
  }
  AddCandidates(experiment, hasher);
  for (const auto& effect : model.effects()) hasher->Text(effect.Text());
  for (const CommandSpec& command : experiment.commands) hasher->Text(command.actuator).Text(command.fallback);
  for (const MeasuredSpec& signal : experiment.measured) {
    const double numbers[] = {static_cast<double>(signal.kind), signal.resolution, signal.scored ? 1.0 : 0.0};
    hasher->Text(signal.signal).Text(signal.on).Text(signal.offset_parameter).Numbers(numbers);
    hasher->Text(signal.filter.cutoff).Text(signal.filter.damping_ratio);
  }
}

void AddRecording(const Recording& recording, Hasher* hasher) {
  hasher->Numbers(recording.time_s);
  for (const auto& command : recording.commands) hasher->Text(command.actuator).Numbers(command.values);
  for (const auto& measured : recording.measured) hasher->Text(measured.spec.signal).Numbers(measured.values);
  for (const auto& [name, value] : recording.values) hasher->Text(name).Number(value);
}

}  // namespace gapscope
