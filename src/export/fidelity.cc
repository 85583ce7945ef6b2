#include "src/export/fidelity.h"

#include <algorithm>

#include "src/experiment/expression.h"
#include "src/tune/tune.h"

namespace gapscope {
namespace {

double ErrorOf(const Model& model, const std::vector<double>& values, const std::vector<Recording>& logs,
               ThreadPool& pool) {
  const double window_s = model.experiment().replay.window_s;
  const TuneOptions fit{.window_s = window_s};
  return ReplayError(Evaluate(model, logs, {values, std::nullopt}, ReplayMode::kWindows, fit, pool));
}

// The experiment on a file that holds its own values: what each log sets anew is set, and nothing else.
Experiment Bare(const Experiment& experiment, const std::string& mjcf) {
  Experiment bare = experiment;
  bare.model_path = mjcf;
  bare.actuators.clear();
  bare.hold.clear();
  bare.inertia.clear();
  std::erase_if(bare.settings, [&](const FieldSetting& setting) {
    return std::ranges::none_of(setting.expressions, [&](const std::string& expression) {
      return std::ranges::any_of(experiment.values,
                                 [&](const LogValue& value) { return Mentions(expression, value.name); });
    });
  });
  return bare;
}

}  // namespace

double FidelityErrors::Lost() const {
  return nominal > model ? std::max(0.0, (exported - model) / (nominal - model)) : kNaN;
}

Result<FidelityErrors> MeasureFidelity(const Model& model, std::span<const double> values, const ExportedFile& file,
                                       const std::vector<Recording>& logs, ThreadPool& pool) {
  FidelityErrors errors;
  GS_ASSIGN(const auto nominal, Model::Build(model.rig()));
  std::shared_ptr<const Rig> rig = model.rig();
  if (!file.path.empty()) {
    GS_ASSIGN(rig, Rig::Load(Bare(model.experiment(), file.path)));
  }
  std::vector<EffectUse> beside = file.host;
  std::map<std::string, double> late;
  for (const auto& [drive, delay_s] : file.delays_s) {
    beside.push_back({"command_delay", drive});
    late[beside.back().Text() + ".delay_s"] = delay_s;
  }
  GS_ASSIGN(const auto exported, Model::Build(std::move(rig), beside, {}));
  std::vector<double> of_exported = exported->Nominal();
  for (std::size_t i = 0; i < of_exported.size(); ++i) {
    const std::string& name = exported->parameters()[i].name;
    if (const auto by_steps = late.find(name); by_steps != late.end())
      of_exported[i] = by_steps->second;
    else if (const int same = model.IndexOf(name); same >= 0)
      of_exported[i] = values[static_cast<std::size_t>(same)];
  }
  errors.nominal = ErrorOf(*nominal, nominal->Nominal(), logs, pool);
  errors.model = ErrorOf(model, {values.begin(), values.end()}, logs, pool);
  errors.exported = ErrorOf(*exported, of_exported, logs, pool);
  return errors;
}

}  // namespace gapscope
