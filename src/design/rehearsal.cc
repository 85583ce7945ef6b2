#include "src/design/rehearsal.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "src/core/collect.h"
#include "src/core/names.h"
#include "src/core/statistics.h"

namespace gapscope {
namespace {

constexpr const char* kPrefix = "limit ";

MeasuredSpec LimitSignal(const std::string& name, SignalKind kind, const std::string& on) {
  MeasuredSpec spec;
  spec.signal = kPrefix + name;
  spec.columns = {spec.signal};
  spec.kind = kind;
  spec.on = on;
  spec.unit = TraitsOf(kind).units[0];
  spec.optional = true;
  spec.scored = false;
  return spec;
}

bool IsLimitSignal(const MeasuredSpec& spec) { return spec.signal.starts_with(kPrefix); }

}  // namespace

Experiment WithLimitSignals(Experiment experiment) {
  std::vector<MeasuredSpec> added;
  for (const auto& limit : experiment.limits) {
    if (limit.position > 0) added.push_back(LimitSignal(limit.joint + " angle", SignalKind::kPosition, limit.joint));
    if (limit.speed > 0) added.push_back(LimitSignal(limit.joint + " speed", SignalKind::kVelocity, limit.joint));
    if (limit.torque > 0) added.push_back(LimitSignal(limit.actuator + " torque", SignalKind::kTorque, limit.actuator));
  }
  experiment.measured.insert(experiment.measured.end(), added.begin(), added.end());
  return experiment;
}

double CommandLimit(const Experiment& experiment, const std::string& actuator) {
  for (const auto& limit : experiment.limits) {
    if (limit.actuator == actuator && limit.command > 0) return limit.command;
  }
  return 0;
}

Result<std::size_t> DrivenCommand(const Experiment& experiment, const RehearsalOptions& options) {
  if (experiment.commands.empty())
    return Error{.what = "the experiment has no command to drive", .where = experiment.path};
  const std::vector<std::string> names = Collect(experiment.commands, &CommandSpec::actuator);
  for (const auto& [name, value] : options.hold) {
    if (std::find(names.begin(), names.end(), name) == names.end())
      return NoSuch("no command drives that actuator", name, names, "--hold");
  }
  for (const auto& limit : experiment.limits) {
    if (!limit.actuator.empty() && std::find(names.begin(), names.end(), limit.actuator) == names.end()) {
      return Error{.what = "a limit on an actuator that no command drives",
                   .where = limit.where,
                   .actual = "'" + limit.actuator + "'",
                   .allowed = Join(names)};
    }
  }
  if (options.actuator.empty()) return std::size_t{0};
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == options.actuator) return i;
  }
  return NoSuch("no command drives that actuator", options.actuator, names, "--actuator");
}

Result<Recording> MakeInput(const Experiment& experiment, const RehearsalOptions& options,
                            const std::vector<double>& values) {
  GS_ASSIGN(const std::size_t driven, DrivenCommand(experiment, options));
  Recording input;
  input.log_path = "designed";
  for (std::size_t k = 0; k < values.size(); ++k) input.time_s.push_back(static_cast<double>(k) / options.rate_hz);
  input.timeline.time_s = input.time_s;
  input.timeline.median_step_s = 1 / options.rate_hz;
  input.rows_in_log = values.size();
  for (const auto& spec : experiment.values) {
    if (const auto given = options.log_values.find(spec.name); given != options.log_values.end()) {
      input.values[spec.name] = given->second;
    } else if (spec.fallback) {
      input.values[spec.name] = *spec.fallback;
    } else {
      return Error{.what = "a log would bring '" + spec.name + "', and there is no log",
                   .where = experiment.path,
                   .cure = "add --value " + spec.name + "=NUMBER"};
    }
  }
  for (std::size_t c = 0; c < experiment.commands.size(); ++c) {
    const CommandSpec& spec = experiment.commands[c];
    Recording::Command command{.actuator = spec.actuator};
    if (!spec.columns.empty()) command.column = spec.columns.front();
    if (c == driven) {
      command.values = values;
      for (double& value : command.values) value += options.offset;
    } else {
      double constant = 0;
      if (const auto held = options.hold.find(spec.actuator); held != options.hold.end()) {
        constant = held->second;
      } else {
        GS_ASSIGN(constant, EvaluateOnce(spec.fallback, input.values,
                                         experiment.path + ": default of command '" + spec.actuator + "'"));
      }
      command.values.assign(values.size(), constant);
    }
    input.commands.push_back(std::move(command));
  }
  for (std::size_t i = 0; i < experiment.measured.size(); ++i) {
    input.measured.push_back({.spec = experiment.measured[i],
                              .index = i,
                              .column = experiment.measured[i].columns.front(),
                              .values = std::vector<double>(values.size(), kNaN)});
  }
  return input;
}

Rehearsal Rehearse(const Model& model, Simulator& simulator, Recording input, const std::vector<double>& values,
                   const LackedLoad& lacks) {
  Rehearsal rehearsal{.recording = std::move(input)};
  Recording& recording = rehearsal.recording;
  const std::size_t signals = recording.measured.size();
  std::vector<double> predicted(recording.rows() * signals, kNaN);
  const auto shift = [&](double by) {
    if (by == 0) return;
    for (double& value : recording.commands[lacks.command].values) value += by;
  };
  shift(-lacks.value);
  const bool simulated =
      simulator.SetParameters(values, recording) &&
      simulator.Run(recording, {0, recording.rows()}, AtRest(model), predicted).outcome == Outcome::kCompleted;
  shift(lacks.value);
  for (std::size_t s = 0; s < signals; ++s) {
    for (std::size_t r = 0; r < recording.rows(); ++r) recording.measured[s].values[r] = predicted[r * signals + s];
  }
  const Experiment& experiment = model.experiment();
  const auto add = [&](const std::string& name, const std::string& unit, double reached, double limit) {
    rehearsal.extremes.push_back({.name = name, .unit = unit, .reached = reached, .limit = limit});
    rehearsal.worst = std::max(rehearsal.worst, reached / limit);
  };
  const auto reached = [&](const std::string& name) {
    for (const auto& measured : recording.measured) {
      if (measured.spec.signal == kPrefix + name) return LargestMagnitude(measured.values);
    }
    return kNaN;
  };
  for (const auto& limit : experiment.limits) {
    if (limit.command > 0) {
      for (std::size_t c = 0; c < experiment.commands.size(); ++c) {
        if (experiment.commands[c].actuator == limit.actuator)
          add(limit.actuator + " command", experiment.commands[c].unit, LargestMagnitude(recording.commands[c].values),
              limit.command);
      }
    }
    if (limit.torque > 0) add(limit.actuator + " torque", "N m", reached(limit.actuator + " torque"), limit.torque);
    if (limit.position > 0) add(limit.joint + " angle", "rad", reached(limit.joint + " angle"), limit.position);
    if (limit.speed > 0) add(limit.joint + " speed", "rad/s", reached(limit.joint + " speed"), limit.speed);
  }
  if (!simulated) rehearsal.worst = kInfinity;
  return rehearsal;
}

Result<double> LargestAmplitude(const std::vector<ModelAndValues>& models, const RehearsalOptions& options,
                                const std::vector<double>& unit_wave, double highest, double margin) {
  const auto worst_at = [&](double amplitude) -> Result<double> {
    std::vector<double> values(unit_wave);
    for (double& value : values) value *= amplitude;
    double worst = 0;
    for (const auto& one : models) {
      GS_ASSIGN(Recording input, MakeInput(one.model->experiment(), options, values));
      worst = std::max(worst, Rehearse(*one.model, *one.simulator, std::move(input), one.values, one.lacks).worst);
      if (worst > 4 * margin) break;
    }
    return worst;
  };
  // From above by the worst ratio itself (exact where the rig is linear), then halving what is left.
  double amplitude = highest, safe = 0, unsafe = 0;
  for (int i = 0; i < 10; ++i) {
    GS_ASSIGN(const double worst, worst_at(amplitude));
    if (worst <= margin * (1 + 1e-9)) {
      safe = amplitude;
      if (amplitude >= highest || worst > 0.95 * margin) break;
    } else {
      unsafe = amplitude;
    }
    const double by_ratio = amplitude * std::clamp(0.98 * margin / worst, 0.1, 10.0);
    amplitude = std::min(highest, safe > 0 && unsafe > 0 ? 0.5 * (safe + unsafe) : by_ratio);
    if (safe > 0 && unsafe > 0 && unsafe - safe < 0.03 * safe) break;
  }
  if (!(safe > 0))
    return Error{.what = "the limits are passed at every amplitude that was tried",
                 .where = "limits",
                 .actual = fmt::format("down to {:.3g}", amplitude)};
  return safe;
}

Result<double> HoldingCommand(const std::vector<ModelAndValues>& models, const RehearsalOptions& options,
                              double duration_s) {
  constexpr double kStays = 0.1, kHeld = 0.01, kFirst = 0.02;  // shares of the limits
  constexpr int kSteps = 10;
  const ModelAndValues& first = models.front();
  const Experiment& experiment = first.model->experiment();
  GS_ASSIGN(const std::size_t driven, DrivenCommand(experiment, options));
  const double most = CommandLimit(experiment, experiment.commands[driven].actuator);
  const std::vector<double> rest(static_cast<std::size_t>(duration_s * options.rate_hz) + 1, 0.0);
  const auto rehearse = [&](const ModelAndValues& on, double command) -> Result<Rehearsal> {
    RehearsalOptions held = options;
    held.offset = command;
    GS_ASSIGN(Recording input, MakeInput(on.model->experiment(), held, rest));
    return Rehearse(*on.model, *on.simulator, std::move(input), on.values);
  };
  const auto worst = [&](double command) -> Result<double> {
    double most_of_all = 0;
    for (const ModelAndValues& on : models) {
      GS_ASSIGN(const Rehearsal rehearsal, rehearse(on, command));
      most_of_all = std::max(most_of_all, rehearsal.worst);
    }
    return most_of_all;
  };
  // Where the angle that is farthest off at the end stands, as a share of its limit.
  const auto drift = [&](double command) -> Result<double> {
    GS_ASSIGN(const Rehearsal rehearsal, rehearse(first, command));
    double share = 0;
    for (const Limit& limit : experiment.limits) {
      if (!(limit.position > 0)) continue;
      for (const auto& measured : rehearsal.recording.measured) {
        if (measured.spec.signal != kPrefix + limit.joint + " angle") continue;
        const double end = measured.values.back() / limit.position;
        if (std::isfinite(end) && std::abs(end) > std::abs(share)) share = end;
      }
    }
    return share;
  };
  GS_ASSIGN(const double alone, worst(0));
  if (!(most > 0) || alone <= kStays) return 0.0;
  GS_ASSIGN(double before, drift(0));
  double command_before = 0, command = kFirst * most;
  for (int step = 0; step < kSteps && std::abs(before) > kHeld; ++step) {
    GS_ASSIGN(const double now, drift(command));
    const double slope = (now - before) / (command - command_before);
    if (!(std::abs(slope) > 0)) return 0.0;
    command_before = std::exchange(command, std::clamp(command - now / slope, -most, most));
    before = now;
  }
  GS_ASSIGN(const double held, worst(command_before));
  return held < 0.5 * alone ? command_before : 0.0;
}

std::string InputCsv(const Experiment& experiment, const Rehearsal& rehearsal) {
  const Recording& recording = rehearsal.recording;
  std::string text = experiment.timeline.time_column.empty() ? "time_s" : experiment.timeline.time_column;
  const std::map<std::string, double> kPerSecond = {{"", 1}, {"s", 1}, {"ms", 1e3}, {"us", 1e6}, {"ns", 1e9}};
  const double per_second = kPerSecond.at(experiment.timeline.time_unit);
  std::vector<std::size_t> commands;
  for (std::size_t c = 0; c < recording.commands.size(); ++c) {
    const auto& column = recording.commands[c].column;
    if (!column) continue;
    commands.push_back(c);
    text += "," + *column;
  }
  for (const auto& measured : recording.measured) {
    if (!IsLimitSignal(measured.spec)) text += ",predicted." + measured.spec.signal;
  }
  for (const auto& extreme : rehearsal.extremes) {
    std::string name = extreme.name;
    std::replace(name.begin(), name.end(), ' ', '_');
    text += ",limit." + name;
  }
  text += "\n";
  for (std::size_t r = 0; r < recording.rows(); ++r) {
    fmt::format_to(std::back_inserter(text), "{:.10g}", recording.time_s[r] * per_second);
    for (const std::size_t c : commands) {
      const CommandSpec& spec = experiment.commands[c];
      fmt::format_to(std::back_inserter(text), ",{:.10g}",
                     (recording.commands[c].values[r] - spec.offset) / spec.factor);
    }
    for (const auto& measured : recording.measured) {
      if (!IsLimitSignal(measured.spec)) fmt::format_to(std::back_inserter(text), ",{:.8g}", measured.values[r]);
    }
    for (const auto& extreme : rehearsal.extremes) fmt::format_to(std::back_inserter(text), ",{:.6g}", extreme.limit);
    text += "\n";
  }
  return text;
}

}  // namespace gapscope
