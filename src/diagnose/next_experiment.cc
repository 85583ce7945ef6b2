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
  const Recording& log = bench.data.train.front();
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

// Of the best input; where its pairs are the ordered ones of so many explanations.
ForetoldMisfit MisfitOf(const InputScore& best, std::size_t explanations, double remaining) {
  ForetoldMisfit misfit{.seconds = best.wave.duration_s, .there = kInfinity, .not_there = kInfinity};
  std::size_t pair = 0;
  for (std::size_t truth = 0; truth < explanations; ++truth) {
    for (std::size_t imitation = 0; imitation < explanations; ++imitation) {
      if (truth == imitation) continue;
      const double square = best.per_target[pair] * best.per_target[pair] / remaining;
      if (truth == 0) misfit.there = std::min(misfit.there, square);
      if (imitation == 0) misfit.not_there = std::min(misfit.not_there, square);
      ++pair;
    }
  }
  return misfit;
}

Result<NextExperiment> Design(const OpenQuestion& question, const Workbench& bench, const std::vector<double>& noise) {
  NextExperiment next = question.next;
  OptimalOptions options{.duration_s = kDiagnosePolicy.next.duration_s,
                         .floors = noise,
                         .window_s = bench.window_s,
                         .time_step_s = bench.time_step_s,
                         .deadline = bench.deadline};
  Experiment experiment = bench.rig->experiment();
  GS_ASSIGN([[maybe_unused]] const std::size_t driven, DrivenCommand(experiment, {}));  // there is a command
  FillLimits(bench.data, options.margin, &experiment);
  // The new log has the columns that these have.
  const LoggedSignals logged = WhatIsLogged(bench.data.train);
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
  const Hypothesis nominal{.name = "nominal", .model = bare, .values = bare->Nominal()};
  GS_ASSIGN(const OptimalDesign design, DesignForRivals(nominal, rivals, options, bench.pool));
  const InputScore& best = design.inputs.front();
  const Foretold foretold = Foretell(question, MisfitOf(best, rivals.size(), question.remaining));
  next.if_present = foretold.if_present;
  next.if_absent = foretold.if_absent;
  const double present = kDiagnosePolicy.probability.present;
  if (next.if_present < present || next.if_absent >= present) {
    next.problem = fmt::format(
        "the best of {} inputs would bring P to {:.2f} if it is there and to {:.2f} if not. Another signal may tell.",
        design.inputs.size(), next.if_present, next.if_absent);
    return next;
  }
  next.command = CommandFor(experiment.path, options.rehearsal, best) + " --out next_experiment.csv";
  next.input_csv = InputCsv(experiment, best.rehearsal);
  return next;
}

}  // namespace

// What a size costs is a parabola of it: `known` is what these logs lose without the effect, `more` what the new one
// would. Where the effect is not there, the size that suits both logs lies between them.
Foretold Foretell(const OpenQuestion& question, const ForetoldMisfit& misfit) {
  const double gain = LargestGain(question.numbers), total = question.seconds + misfit.seconds;
  const double known = question.seconds * std::expm1(std::max(0.0, gain)), more = misfit.seconds * misfit.there;
  double present = 0, absent = 0, kept = 0;
  if (question.nested) {
    kept = known + more > 0 ? known / (known + more) : 0;
    present = std::log1p((known + more) / total);
    absent = -std::log1p(-known * kept / (total + known));
  } else {
    const double old = question.seconds * std::exp(gain);
    present = std::log((old + misfit.seconds * (1 + misfit.there)) / total);
    absent = std::log((old + misfit.seconds) / (question.seconds + misfit.seconds * (1 + misfit.not_there)));
  }
  // Of what an effect gains, random torques gain a part as well: the same one as in these logs, where they say.
  const double told = 0.5 * CountOf(question.seconds) * gain;
  const bool says = question.nested && gain > kDiagnosePolicy.search.tie;
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
  return {.if_present = at(present, std::hypot(std::max(0.0, clear), 0.5 * std::sqrt(count * misfit.there))),
          .if_absent = at(absent, question.nested ? clear * kept : -0.5 * std::sqrt(count * misfit.not_there))};
}

NextExperiment DesignNext(const AskNext& ask, const Workbench& bench, const std::vector<double>& noise) {
  std::optional<NextExperiment> first;
  while (const auto question = ask()) {
    auto designed = Design(*question, bench, noise);
    NextExperiment next = question->next;
    if (designed.ok()) {
      next = std::move(designed).value();
    } else {
      next.problem = designed.error().Text();
    }
    if (next.problem.empty()) return next;
    if (!first) first = std::move(next);
  }
  return first.value_or(NextExperiment{});
}

}  // namespace gapscope
