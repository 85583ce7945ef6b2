#include "src/diagnose/next_experiment.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "src/core/collect.h"
#include "src/core/statistics.h"
#include "src/design/optimal.h"
#include "src/diagnose/policy.h"
#include "src/diagnose/probability.h"
#include "src/fit/policy.h"

namespace gapscope {
namespace {

// Residuals that say something, in so many seconds.
double CountOf(double seconds) { return kDiagnosePolicy.evidence.per_block * seconds / kFitPolicy.block_s; }

// The entry of a joint or an actuator, with whatever is stated of it.
Limit& LimitOf(const std::string& joint, const std::string& actuator, std::vector<Limit>* limits) {
  for (Limit& limit : *limits) {
    if (limit.joint == joint && limit.actuator == actuator) return limit;
  }
  limits->push_back({.joint = joint, .actuator = actuator});
  return limits->back();
}

// What is not stated is what the logs reached, all of which may be used.
void FillLimits(const DataSplit& data, double margin, Experiment* experiment) {
  std::vector<Limit> reached;
  for (const Recording& log : data.train) {
    for (const auto& command : log.commands) {
      double& most = LimitOf("", command.actuator, &reached).command;
      most = std::max(most, LargestMagnitude(command.values) / margin);
    }
    for (const auto& measured : log.measured) {
      if (measured.spec.kind != SignalKind::kPosition) continue;
      double& most = LimitOf(measured.spec.on, "", &reached).position;
      most = std::max(most, LargestMagnitude(measured.values) / margin);
    }
  }
  for (const Limit& log : reached) {
    Limit& limit = LimitOf(log.joint, log.actuator, &experiment->limits);
    if (limit.command == 0) limit.command = log.command;
    if (limit.position == 0) limit.position = log.position;
  }
}

// The drive of the place that is asked about, else the first; others stand where the first log begins.
RehearsalOptions RehearsalOf(const OpenQuestion& question, const Workbench& bench) {
  const Recording& log = bench.data->train.front();
  RehearsalOptions options{.log_values = log.values, .rate_hz = 1 / bench.sample_s};
  for (const Explanation& asked : question.next.separates) {
    if (!asked || !options.actuator.empty()) continue;
    for (const auto& command : log.commands) {
      if (command.actuator == asked->on || bench.rig->ActuatorOf(asked->on) == command.actuator)
        options.actuator = command.actuator;
    }
  }
  if (options.actuator.empty()) options.actuator = log.commands.front().actuator;
  for (const auto& command : log.commands) {
    if (command.actuator != options.actuator && !command.values.empty())
      options.hold[command.actuator] = command.values.front();
  }
  return options;
}

// Of the best input: what the nearest of the other rivals leaves of the first one, and the first one of them. A rival
// that holds the first one imitates it: by what it would show beyond it, it is told where it is there, and where not.
ForetoldMisfit MisfitOf(const InputScore& best, const std::vector<Hypothesis>& rivals, bool nested, double remaining) {
  const std::size_t others = rivals.size() - 1;
  const auto square = [&](std::size_t truth, std::size_t imitation) {
    const double floors = best.per_target[truth * others + imitation - (imitation > truth ? 1 : 0)];
    return floors * floors / remaining;
  };
  ForetoldMisfit misfit{.seconds = best.wave.duration_s, .there = kInfinity, .not_there = kInfinity};
  for (std::size_t other = 1; other < rivals.size(); ++other) {
    const double there = square(0, other), not_there = square(other, 0);
    const bool held = !nested && Holds(rivals[other], rivals[0]), holds = !nested && Holds(rivals[0], rivals[other]);
    misfit.there = std::min(misfit.there, held ? not_there : there);
    misfit.not_there = std::min(misfit.not_there, holds ? there : not_there);
  }
  return misfit;
}

Result<NextExperiment> Design(const OpenQuestion& question, double duration_s, const Workbench& bench,
                              const std::vector<double>& noise) {
  NextExperiment next = question.next;
  OptimalOptions options{.duration_s = duration_s,
                         .floors = noise,
                         .window_s = bench.window_s,
                         .time_step_s = bench.time_step_s,
                         .max_windows = bench.max_windows,
                         .coupling = bench.coupling,
                         .deadline = bench.deadline};
  Experiment experiment = bench.rig->experiment();
  GS_ASSIGN([[maybe_unused]] const std::size_t driven, DrivenCommand(experiment, {}));  // there is a command
  FillLimits(*bench.data, options.margin, &experiment);
  // The new log has the columns that these have.
  const LoggedSignals logged = WhatIsLogged(bench.data->train);
  for (MeasuredSpec& spec : experiment.measured) spec.scored = logged.signals.contains(spec.signal);
  experiment = WithLimitSignals(experiment);
  GS_ASSIGN(const auto rig, Rig::Load(experiment));
  options.rehearsal = RehearsalOf(question, bench);
  GS_ASSIGN(const auto bare, Model::Build(rig));
  std::vector<Hypothesis> rivals;
  for (std::size_t i = 0; i < next.models.size(); ++i) {
    GS_ASSIGN(ResultModel built, BuildRunModel(rig, next.models[i], "the next experiment", bench.scales));
    rivals.push_back({.name = NameOf(next.separates[i]), .model = built.model, .values = std::move(built.values)});
  }
  std::vector<std::unique_ptr<Simulator>> simulators;
  std::vector<ModelAndValues> drifting;
  for (const Hypothesis& rival : rivals) {
    simulators.push_back(std::make_unique<Simulator>(*rival.model, bench.time_step_s));
    drifting.push_back({rival.model.get(), simulators.back().get(), rival.values});
  }
  GS_ASSIGN(options.rehearsal.offset, HoldingCommand(drifting, options.rehearsal, duration_s));
  const Hypothesis nominal{.name = "nominal", .model = bare, .values = bare->Nominal()};
  GS_ASSIGN(const OptimalDesign design, DesignForRivals(nominal, rivals, options, bench.pool));
  const InputScore& best = design.inputs.front();
  const Foretold foretold = Foretell(question, MisfitOf(best, rivals, question.nested, question.remaining));
  next.if_present = foretold.if_present;
  next.if_absent = foretold.if_absent;
  if (!IsWorthALog(question, foretold)) {
    next.problem = fmt::format(
        "none of {} inputs would settle it (the best: P {:.2f} if it is there, {:.2f} if not). Another signal may.",
        design.inputs.size(), next.if_present, next.if_absent);
    return next;
  }
  next.command = CommandFor(experiment.path, options.rehearsal, best) + " --out next_experiment.csv";
  next.input_csv = InputCsv(experiment, best.rehearsal);
  return next;
}

// A rig that an effect drives to its limits by itself keeps them in a shorter input.
NextExperiment DesignLongest(const OpenQuestion& question, const Workbench& bench, const std::vector<double>& noise) {
  NextExperiment next = question.next;
  for (double duration_s = kDiagnosePolicy.next.duration_s; duration_s >= kDiagnosePolicy.next.least_duration_s;
       duration_s /= 2) {
    auto designed = Design(question, duration_s, bench, noise);
    if (designed.ok()) return std::move(designed).value();
    if (next.problem.empty()) next.problem = designed.error().Text();
  }
  return next;
}

// What is told together is told apart where one costs more than the other by more than what ties.
Foretold ForetellBetween(const OpenQuestion& question, const ForetoldMisfit& misfit) {
  const double old = question.seconds * std::exp(question.behind), total = question.seconds + misfit.seconds;
  const double second_behind = std::log((old + misfit.seconds * (1 + misfit.there)) / total),
               first_behind = std::log((total + misfit.seconds * misfit.not_there) / (old + misfit.seconds));
  const double apart = kDiagnosePolicy.next.beyond_tie * question.tie;
  return {.if_present = second_behind >= apart ? question.together : question.next.probability,
          .if_absent = first_behind >= apart ? 0 : question.next.probability};
}

// What a size costs is a parabola of it: `known` is what these logs lose without the effect, `more` what the new one
// would. Where the effect is not there, the size that suits both logs lies between them.
Foretold ForetellPresence(const OpenQuestion& question, const ForetoldMisfit& misfit) {
  const double gain = LargestGain(question.numbers), total = question.seconds + misfit.seconds;
  const double known = question.seconds * std::expm1(std::max(0.0, gain)), more = misfit.seconds * misfit.there;
  const double kept = known + more > 0 ? known / (known + more) : 0;
  // Of what an effect gains, random torques gain a part as well: the same one as in these logs, where they say.
  const double told = 0.5 * CountOf(question.seconds) * gain;
  const bool says = gain > kDiagnosePolicy.search.tie;
  const double apart = says ? std::clamp(question.numbers.discrepancy / told, 0.0, 1.0) : kDiagnosePolicy.next.apart;
  const double clear = question.numbers.clear, count = CountOf(misfit.seconds);
  const auto at = [&](double gained, double clear_by) {
    StatementNumbers numbers = question.numbers;
    numbers.gain = gained;
    numbers.gain_held_out = numbers.gain_free = kNaN;
    numbers.discrepancy = apart * 0.5 * CountOf(total) * gained;
    numbers.clear = clear_by;
    return ProbabilityOf(numbers);
  };
  // A difference of squares over its standard error, where residuals are normal: half of the root of their sum.
  const double clear_there = std::hypot(std::max(0.0, clear), 0.5 * std::sqrt(count * misfit.there));
  return {.if_present = at(std::log1p((known + more) / total), clear_there),
          .if_absent = at(-std::log1p(-known * kept / (total + known)), clear * kept)};
}

}  // namespace

Foretold Foretell(const OpenQuestion& question, const ForetoldMisfit& misfit) {
  return question.nested ? ForetellPresence(question, misfit) : ForetellBetween(question, misfit);
}

bool IsWorthALog(const OpenQuestion& question, const Foretold& foretold) {
  if (!question.nested) return foretold.if_present > question.next.probability;
  return foretold.if_present - foretold.if_absent >= kDiagnosePolicy.next.answers;
}

NextExperiment DesignNext(const AskNext& ask, const Workbench& bench, const std::vector<double>& noise) {
  std::optional<NextExperiment> first;
  for (std::size_t designs = 0; designs < kDiagnosePolicy.next.designs;) {
    const auto question = ask();
    if (!question) break;
    NextExperiment next = question->next;
    if (next.problem.empty()) {
      next = DesignLongest(*question, bench, noise);
      ++designs;
    }
    if (next.problem.empty()) return next;
    if (!first) first = std::move(next);
  }
  return first.value_or(NextExperiment{});
}

}  // namespace gapscope
