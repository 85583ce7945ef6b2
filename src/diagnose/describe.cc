#include "src/diagnose/describe.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "src/compare/comparison.h"
#include "src/core/collect.h"
#include "src/core/statistics.h"
#include "src/diagnose/beside.h"
#include "src/diagnose/explain.h"
#include "src/diagnose/gap_shares.h"
#include "src/diagnose/judge.h"
#include "src/diagnose/left_out.h"
#include "src/diagnose/next_experiment.h"
#include "src/diagnose/policy.h"
#include "src/diagnose/remainder.h"
#include "src/diagnose/sizes.h"
#include "src/experiment/local_fit.h"

namespace gapscope {
namespace {

// Schwarz's criterion on the training logs, residuals taken as independent and their variance as unknown: a baseline to
// compare with, no more.
double Bic(const Candidate& candidate) {
  const double n = static_cast<double>(candidate.problem->residuals());
  return n * std::log(std::max(candidate.train_cost, 1e-300)) + std::log(n) * static_cast<double>(candidate.parameters);
}

// Of the held-out logs.
std::vector<SignalFloors> FloorsOfSignals(const Workbench& bench, const BlockErrors& errors) {
  struct Sum {
    std::string signal;
    double squares = 0, rows = 0;
  };
  std::map<std::size_t, Sum> sums;
  for (std::size_t l = 0; l < errors.size(); ++l) {
    for (std::size_t s = 0; s < errors[l].size(); ++s) {
      if (!errors[l][s].scored || errors[l][s].rows == 0) continue;
      const auto& measured = bench.data->held_out[l].measured[s];
      Sum& sum = sums[measured.index];
      sum.signal = measured.spec.signal;
      sum.rows += errors[l][s].rows;
      for (const auto& [block, square] : errors[l][s].squares) sum.squares += square;
    }
  }
  auto signals = Collect(sums, [&](const auto& entry) {
    const Sum& sum = entry.second;
    return SignalFloors{sum.signal, bench.weights[entry.first] * std::sqrt(sum.squares / sum.rows)};
  });
  std::stable_sort(signals.begin(), signals.end(), [](const auto& a, const auto& b) { return a.floors > b.floors; });
  return signals;
}

// Where a model's error lies, on the first held-out log, which stands for all (shares of several logs do not add up).
// Signals in which the noise is the larger part of what is missed come last: the gap does not lie there.
std::vector<ConditionShare> Locate(const Workbench& bench, const std::vector<LogReplay>& predicted,
                                   const std::vector<SignalFloors>& signals, std::uint64_t seed) {
  LogComparison located;
  if (predicted.empty()) return {};
  const LogReplay& log = predicted.front();
  const Recording& recording = bench.data->held_out.front();
  for (std::size_t s = 0; s < log.signals.size(); ++s) {
    const SignalTrace& trace = log.signals[s];
    if (!trace.scored) continue;
    ConditionInput input{
        .signal = trace.signal, .time_s = log.time_s, .measured = trace.measured, .predicted = trace.predicted};
    std::vector<double> speed;
    if (TraitsOf(trace.kind).gives_angle) {
      for (std::size_t row = 0; row < recording.rows(); ++row)
        speed.push_back(FitLocally(recording, recording.measured[s], row, kInitialFitHalfWidth_s).slope);
      input.speed = speed;
      input.angle = trace.measured;
    }
    if (const int c = bench.rig->CommandOfSignal(trace.signal); c >= 0)
      input.command = recording.commands[static_cast<std::size_t>(c)].values;
    located.signals.push_back(ScoreSignal(trace.signal, log.time_s, trace.measured, trace.predicted, trace.resolution));
    for (auto& share : LocateError(input, {.seed = seed})) located.where.push_back(std::move(share));
  }
  std::vector<ConditionShare> where = TellOfWorst(located, {.limit = 12});
  std::stable_partition(where.begin(), where.end(), [&](const ConditionShare& share) {
    const auto found = std::ranges::find(signals, share.signal, &SignalFloors::signal);
    return found != signals.end() && found->floors * found->floors > 2;
  });
  return where;
}

// `predicted`: by the final model.
void SayWhereItLies(const Workbench& bench, const Candidate& base, const Candidate& chosen,
                    const std::vector<LogReplay>& predicted, std::uint64_t seed, Diagnosis* result) {
  result->evidence.signals = FloorsOfSignals(bench, chosen.held_out);
  result->remains = Locate(bench, predicted, result->evidence.signals, seed);
  result->where = &base == &chosen
                      ? result->remains
                      : Locate(bench, PredictHeldOut(bench, base), FloorsOfSignals(bench, base.held_out), seed);
}

// Base parameters that ended on a bound.
std::vector<AtBound> FindAtBounds(const Workbench& bench, const Candidate& candidate, const Model& base) {
  std::vector<AtBound> found;
  for (const int i : bench.FreeParameters(base)) {
    const Parameter& p = base.parameters()[static_cast<std::size_t>(i)];
    const double value = candidate.values[static_cast<std::size_t>(candidate.model->IndexOf(p.name))];
    const OnBound bound = BoundOf(value, p.low, p.high);
    if (bound == OnBound::kNo || bound == BoundOf(p.nominal, p.low, p.high)) continue;
    found.push_back({.name = p.name, .unit = p.unit, .value = value});
  }
  return found;
}

// The effects that are there, the largest share first.
std::vector<FoundEffect> DescribeEffects(const Workbench& bench, SearchResult& found, const Candidate& final,
                                         const BesideTorques& beside, const LeftOut& left_out, Judgement* judgement) {
  std::vector<FoundEffect> effects;
  const auto sizes = EstimateSizes(bench, final, beside.widening, left_out.values);
  GapShares shares(bench, found, final, judgement->groups);
  for (Statement& s : judgement->statements) {
    if (const auto bounds = beside.bounds.find(s.use); s.answer == Answer::kAbsent && bounds != beside.bounds.end())
      s.bounds = bounds->second;
    const auto place = sizes.find(s.use);
    if (place == sizes.end()) continue;
    s.parameters = place->second;
    s.share_of_gap = shares.Of(s.use);
    const Effect& entry = EffectOf(s.use, *bench.rig);
    effects.push_back({.use = s.use,
                       .meaning = entry.meaning,
                       .signature = entry.signature,
                       .probability = s.probability,
                       .parameters = s.parameters,
                       .error_before = found.base->held_out_error,
                       .error_after = final.held_out_error,
                       .share_of_gap = s.share_of_gap.value});
    if (s.group < 0) continue;
    for (const EffectUse& other : judgement->groups[static_cast<std::size_t>(s.group)]) {
      if (other != s.use && sizes.contains(other)) effects.back().together.push_back(other);
    }
  }
  std::stable_sort(effects.begin(), effects.end(),
                   [](const auto& a, const auto& b) { return a.share_of_gap > b.share_of_gap; });
  // What stands before each: the base model with the effects that are listed earlier.
  EffectSet before;
  for (std::size_t i = 0; i + 1 < effects.size(); ++i) {
    before = With(before, effects[i].use);
    Candidate* part = found.ledger.FindOrTry(before, final);
    if (!part) continue;
    ScoreCandidate(bench, part);
    effects[i + 1].error_before = part->held_out_error;
  }
  return effects;
}

// The base model and every single effect, those that were refitted with what they cost.
std::vector<CandidateReport> DescribeCandidates(const Workbench& bench, const SearchResult& found,
                                                const Judgement& judgement) {
  std::vector<CandidateReport> reports;
  const auto report_of = [&](const Explanation& effect, Candidate* fitted) {
    CandidateReport report{.effect = effect, .held_out_error = kNaN};
    if (fitted) {
      ScoreCandidate(bench, fitted);
      report.held_out_error = fitted->held_out_error;
      report.refitted = true;
      report.converged = fitted->converged;
      report.bic = Bic(*fitted);
      report.reason = fmt::format("alone it leaves {:.1f} times the noise", fitted->held_out_floors);
    }
    return report;
  };
  double total = 0;
  for (const Statement& s : judgement.statements) {
    CandidateReport report = report_of(s.use, found.ledger.Find({s.use}));
    report.probability = s.probability;
    for (std::size_t t = 0; t < found.columns.trials.size(); ++t) {
      if (found.columns.trials[t].use == s.use)
        report.promise = std::max(report.promise, 1 - SetCost(found.columns, {t}) / found.columns.cost);
    }
    report.reason = report.reason.empty() ? s.rule : s.rule + "; " + report.reason;
    total += s.probability;
    reports.push_back(std::move(report));
  }
  double none = 1;
  for (const auto& report : reports) none *= 1 - report.probability;
  // Over single explanations, adding up to one.
  reports.insert(reports.begin(), report_of({}, found.base));
  reports.front().probability = none;
  for (auto& report : reports) {
    if (report.effect) report.probability *= total > 0 ? (1 - none) / total : 0;
  }
  std::stable_sort(reports.begin(), reports.end(), [](const auto& a, const auto& b) {
    return a.probability != b.probability ? a.probability > b.probability : a.promise > b.promise;
  });
  return reports;
}

// The set of the effects that are there, refitted to the end.
Candidate* FinalSet(const Workbench& bench, SearchResult& found, const Judgement& judgement) {
  EffectSet set;
  for (const EffectUse& use : found.chosen->effects) {
    if (std::any_of(judgement.statements.begin(), judgement.statements.end(),
                    [&](const Statement& s) { return s.use == use && s.answer == Answer::kPresent; }))
      set = With(set, use);
  }
  if (set.empty()) return found.base;
  Candidate* final = found.ledger.Find(set);
  if (!final || final != found.chosen) final = found.ledger.Refit(set, *found.chosen, {}, {}, Effort::kFinish);
  if (!final) return found.chosen;
  PolishCandidate(bench, final);
  ScoreCandidate(bench, final);
  return final;
}

void SayWhatIsLeft(const Workbench& bench, const Candidate& base, const Candidate& final, VerdictEvidence* evidence) {
  VerdictEvidence& e = *evidence;
  e.floors_left = final.held_out_floors;
  const double excess = e.floors_before - std::min(1.0, e.floors_left);
  e.removed = e.floors_before > 1 ? (e.floors_before - e.floors_left) / excess : 0;
  e.free_run_left = e.free_run_before;
  if (&final != &base) {
    FreeRuns free = RunFree(bench, final);
    e.free_run_left = free.error;
    e.free_runs = std::move(free.runs);
  }
  const bool known = std::isfinite(e.free_run_before) && std::isfinite(e.free_run_left) && e.free_run_before > 0;
  e.free_run_removed = known ? 1 - e.free_run_left / e.free_run_before : 0;
}

}  // namespace

Result<Diagnosis> Describe(SearchResult& found, const Workbench& bench, const DescribeOptions& options,
                           const Say& say) {
  const auto& [noise, seed, next_experiment] = options;
  Diagnosis result;
  Judgement judgement = Judge(bench, found, say);
  const Candidate& base = *found.base;
  Candidate& chosen = *FinalSet(bench, found, judgement);
  say("looking beside the final set");
  const BesideTorques beside = LookBeside(bench, chosen, found.uses);
  const Workbench for_sizes = ForSizes(bench, chosen);
  if (for_sizes.windows->size() > bench.windows->size()) {
    say("fitting the final set to more windows");
    PolishCandidate(for_sizes, &chosen);
    ScoreCandidate(bench, &chosen);
  }
  SayWhatIsLeft(bench, base, chosen, &judgement.evidence);
  result.verdict = judgement.verdict;
  result.probability = judgement.probability;
  result.evidence = judgement.evidence;
  result.nominal = found.nominal->held_out_error;
  result.refit = base.held_out_error;
  result.final = chosen.held_out_error;
  result.floor = std::min(FloorError(bench.data->held_out, chosen.held_out, noise), result.final);
  result.closed = ClosedShare(result.refit, result.final, result.floor);
  say("leaving each log out");
  const LeftOut left_out = LeaveOut(for_sizes, base, chosen, noise);
  result.by_log = left_out.gaps;
  result.effects = DescribeEffects(bench, found, chosen, beside, left_out, &judgement);
  for (const Statement& s : judgement.statements) {
    if (s.group < 0 || s.answer != Answer::kPresent) continue;
    const auto& group = judgement.groups[static_cast<std::size_t>(s.group)];
    if (group.front() == s.use) result.ambiguous.push_back(group);
  }
  result.candidates = DescribeCandidates(bench, found, judgement);
  result.statements = judgement.statements;
  const std::vector<LogReplay> predicted = PredictHeldOut(bench, chosen);
  result.remainder = Divide(bench, base, chosen, predicted, result.floor, beside);
  result.at_bounds = FindAtBounds(bench, chosen, *base.model);
  if (next_experiment && !bench.deadline.stopped()) {
    say("designing the next experiment");
    result.next = DesignNext(OpenQuestions(bench, found, judgement), bench, noise);
  }
  SayWhereItLies(bench, base, chosen, predicted, seed, &result);
  result.cut = found.cut;
  if (bench.TimeIsOver()) result.cut.emplace_back("fits while judging");
  result.work = *bench.work;
  for (const auto* part : {&bench.data->train, bench.by_windows ? nullptr : &bench.data->held_out}) {
    if (!part) continue;
    for (const auto& recording : *part) result.data_s += recording.time_s.back() - recording.time_s.front();
  }
  result.most_steps = bench.most_steps;
  result.windows.of_sizes = chosen.problem->windows().size();
  result.model = chosen.model;
  result.values = chosen.values;
  result.nominal_values = found.nominal->values;
  result.refit_model = base.model;
  result.refit_values = base.values;
  result.interrupted = bench.deadline.stopped();
  result.explanation = Explain(result);
  return result;
}

}  // namespace gapscope
