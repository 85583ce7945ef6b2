#include "src/export/fidelity.h"

#include <algorithm>
#include <string_view>

#include "src/experiment/expression.h"
#include "src/tune/tune.h"

namespace gapscope {
namespace {

double ErrorOf(const Model& model, const FixedParameters& fixed, const std::vector<Recording>& logs, ThreadPool& pool,
               StepKind steps = StepKind::kOwn) {
  const TuneOptions fit{.window_s = model.experiment().replay.window_s, .steps = steps};
  return ReplayError(Evaluate(model, logs, fixed, ReplayMode::kWindows, fit, pool));
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

// The same logs with what is sent for their commands.
std::vector<Recording> Sent(std::vector<Recording> logs, const std::map<std::string, SentCommand>& sent) {
  for (Recording& log : logs) {
    for (Recording::Command& command : log.commands) {
      if (const auto of = sent.find(command.actuator); of != sent.end())
        std::ranges::transform(command.values, command.values.begin(), [&](double u) { return of->second.Of(u); });
    }
  }
  return logs;
}

}  // namespace

ExportedFile FileOf(const ExportedModel& exported, const std::string& path) {
  ExportedFile file{.path = path, .host = {}, .delays_s = {}, .sent = exported.sent};
  for (const auto& [drive, steps] : exported.delay_steps) file.delays_s[drive] = steps * exported.spec->option.timestep;
  for (const NativeEffect& effect : exported.native) {
    const bool beside =
        path.empty() ? effect.fidelity != Fidelity::kDropped : effect.fidelity == Fidelity::kHost && !effect.by_sender;
    // The plugin stands in for a law beside the MJCF, as it was stepped beside it (tests/python/test_torch.py).
    if (beside || effect.by_law) file.host.push_back(effect.use);
  }
  constexpr std::string_view kGroup = "friction.";
  for (const auto& [drive, law] : exported.laws) {
    for (const auto& [argument, number] : law) {
      if (argument.starts_with(kGroup)) file.friction[drive]["friction_" + argument.substr(kGroup.size())] = number;
    }
  }
  return file;
}

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
  const auto delay_of = [](const std::string& on) { return EffectUse{"command_delay", on}; };
  for (const auto& [drive, delay_s] : file.delays_s) {
    // The host's delay of all drives is of this one too.
    if (std::ranges::find(file.host, delay_of(kOnAll)) != file.host.end()) break;
    beside.push_back(delay_of(drive));
    late[beside.back().Text() + ".delay_s"] = delay_s;
  }
  GS_ASSIGN(const auto exported, Model::Build(std::move(rig), beside, {}, Contacts::kAsTheMjcf, file.friction));
  std::vector<double> of_exported = exported->Nominal();
  for (std::size_t i = 0; i < of_exported.size(); ++i) {
    const std::string& name = exported->parameters()[i].name;
    if (const auto by_steps = late.find(name); by_steps != late.end())
      of_exported[i] = by_steps->second;
    else if (const int same = model.IndexOf(name); same >= 0)
      of_exported[i] = values[static_cast<std::size_t>(same)];
  }
  StampShift stamps;
  errors.model = ErrorOf(model, {{values.begin(), values.end()}, std::nullopt, &stamps}, logs, pool);
  // How late a log's stamps are is the log's: found anew it would make up for delays that are rounded or not there, and
  // for half of an integrator's step.
  errors.nominal = ErrorOf(*nominal, {nominal->Nominal(), stamps}, logs, pool);
  errors.exported = ErrorOf(*exported, {of_exported, stamps}, file.sent.empty() ? logs : Sent(logs, file.sent), pool,
                            StepKind::kPlain);
  return errors;
}

}  // namespace gapscope
