#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "src/compare/noise.h"
#include "src/core/statistics.h"
#include "src/diagnose/coarsen.h"
#include "src/diagnose/diagnosis.h"
#include "src/diagnose/explain.h"
#include "src/diagnose/rules.h"
#include "src/diagnose/verdict.h"

namespace gapscope {
namespace {

// Noise of each measured signal, from the log itself: the median over logs. SI.
std::vector<double> SignalNoise(const Experiment& experiment, const DataSplit& data) {
  std::vector<std::vector<double>> found(experiment.measured.size());
  for (const auto* part : {&data.train, &data.held_out}) {
    for (const auto& recording : *part) {
      for (const auto& measured : recording.measured) {
        const NoiseFloor floor =
            EstimateNoise(recording.time_s, measured.values, {.resolution = measured.spec.resolution});
        const double least = 1e-3 * MomentsOf(measured.values).deviation;
        const double total = std::isfinite(floor.total_std) ? floor.total_std : measured.spec.resolution;
        found[measured.index].push_back(std::max(total, least));
      }
    }
  }
  std::vector<double> noise(found.size(), 1.0);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i].empty()) continue;
    noise[i] = std::max(Median(found[i]), std::numeric_limits<double>::min());
  }
  return noise;
}

// Schwarz's criterion on the training logs, residuals taken as independent and their variance as unknown: a baseline to
// compare with, no more.
double Bic(const Candidate& candidate) {
  const double n = static_cast<double>(candidate.problem->residuals());
  return n * std::log(std::max(candidate.train_cost, 1e-300)) + std::log(n) * static_cast<double>(candidate.parameters);
}

// The sensors' noise as a normalised error.
double FloorError(const std::vector<Recording>& recordings, const std::vector<double>& noise) {
  double sum = 0, signals = 0;
  for (const auto& recording : recordings) {
    for (const auto& measured : recording.measured) {
      const double share = noise[measured.index] / MomentsOf(measured.values).deviation;
      if (measured.spec.scored && std::isfinite(share)) sum += share * share, signals += 1;
    }
  }
  return std::sqrt(sum / std::max(1.0, signals));
}

// Where a model's error lies, on the first held-out log, which stands for all (shares of several logs do not add up).
std::vector<ConditionShare> Locate(const Candidate& candidate, const std::vector<Recording>& held_out,
                                   std::uint64_t seed) {
  std::vector<ConditionShare> where;
  if (candidate.held_out.empty()) return where;
  const LogReplay& log = candidate.held_out.front();
  const Recording& recording = held_out.front();
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
    if (!recording.commands.empty()) input.command = recording.commands.front().values;
    for (auto& share : LocateError(input, {.seed = seed})) where.push_back(std::move(share));
  }
  return MostTelling(where, {.limit = 12});
}

// The accepted effects with their parameters, and what each takes of the gap: alone, and after the other one, averaged
// (Shapley, 1953).
Result<std::vector<FoundEffect>> DescribeEffects(const SearchResult& found, const Judgement& judgement,
                                                 const ScaleTable& scales) {
  std::vector<FoundEffect> effects;
  const Candidate &chosen = *found.chosen, &base = *found.base;
  if (&chosen == &base) return effects;
  const Uncertainty uncertainty =
      EstimateUncertainty(*chosen.problem, chosen.point,
                          Linearize(*chosen.problem, chosen.point, {.columns = DifferenceOptions::Columns::kCentral}));
  const auto alone = [&](const EffectUse& use) {
    for (const auto& c : found.first.children) {
      if (c->effects.front() == use && std::isfinite(c->held_out_error)) return c->held_out_error;
    }
    return base.held_out_error;
  };
  const auto probability = [&](const EffectUse& use) {
    double p = 0;
    for (std::size_t i = 0; i < judgement.explanations.size(); ++i) {
      const auto& effect = judgement.explanations[i]->effects;
      if (!effect.empty() && effect.front() == use) p = judgement.probabilities[i];
    }
    return std::max(p, chosen.effects.size() == 2 ? judgement.probability : 0.0);
  };
  const double gap = base.held_out_error - chosen.held_out_error;
  for (std::size_t e = 0; e < chosen.effects.size(); ++e) {
    const EffectUse& use = chosen.effects[e];
    const Effect& entry = EffectOf(use, *chosen.model->rig());
    FoundEffect effect{.use = use,
                       .meaning = entry.meaning,
                       .signature = entry.signature,
                       .probability = probability(use),
                       .error_before = base.held_out_error,
                       .error_after = chosen.held_out_error,
                       .share_of_gap = 1};
    for (const auto& p : PlacedParameters(use, *chosen.model->rig(), scales)) {
      for (const auto& tuned : uncertainty.tuned) {
        if (chosen.model->parameters()[tuned.index].name == p.name)
          effect.parameters.push_back({p.key, p.unit, tuned.value, tuned.low, tuned.high});
      }
    }
    if (chosen.effects.size() == 2 && gap > 0) {
      effect.error_before = alone(chosen.effects[1 - e]);
      effect.share_of_gap =
          0.5 * ((base.held_out_error - alone(use)) + (effect.error_before - chosen.held_out_error)) / gap;
    }
    effects.push_back(std::move(effect));
  }
  return effects;
}

Explanation ExplanationOf(const Candidate& c) {
  return c.effects.empty() ? Explanation{} : Explanation(c.effects.front());
}

// Every effect that was tried, and why it was or was not accepted.
std::vector<CandidateReport> DescribeCandidates(const SearchResult& found, const Judgement& judgement) {
  std::vector<CandidateReport> reports;
  std::set<EffectUse> named;
  for (std::size_t i = 0; i < judgement.explanations.size(); ++i) {
    const Candidate& c = *judgement.explanations[i];
    CandidateReport report{.effect = ExplanationOf(c),
                           .probability = judgement.probabilities[i],
                           .held_out_error = c.held_out_error,
                           .refitted = true,
                           .converged = c.converged,
                           .bic = Bic(c),
                           .reason = Reason(c, found)};
    for (const auto& s : found.first.screen) {
      if (!c.effects.empty() && s.use == c.effects.front())
        report.screen_drop = s.trial.drop, report.absorbed = s.trial.absorbed;
    }
    if (report.effect) named.insert(*report.effect);
    reports.push_back(std::move(report));
  }
  for (const auto& s : found.first.screen) {
    if (named.contains(s.use)) continue;
    reports.push_back(
        {.effect = s.use,
         .held_out_error = kNaN,
         .screen_drop = s.trial.drop,
         .absorbed = s.trial.absorbed,
         .reason = !s.left_out.empty() ? s.left_out
                   : !s.trial.visible
                       ? "cannot be seen in these logs: the base model's parameters imitate it fully"
                       : fmt::format("the score test promises {:.2g} % of the error at most, less than the leaders",
                                     100 * s.trial.drop)});
  }
  std::stable_sort(reports.begin(), reports.end(),
                   [](const auto& a, const auto& b) { return a.probability > b.probability; });
  return reports;
}

// Every second effect that was tried beside the first one.
std::vector<CandidateReport> DescribeSeconds(const SearchResult& found) {
  std::vector<CandidateReport> reports;
  for (const auto& s : found.second.screen) {
    CandidateReport report{.effect = s.use,
                           .held_out_error = kNaN,
                           .screen_drop = s.trial.drop,
                           .absorbed = s.trial.absorbed,
                           .reason = s.left_out};
    for (const auto& c : found.second.children) {
      if (c->effects.back() != s.use) continue;
      const Evidence more = Compare(*found.second_parent, *c);
      report.held_out_error = c->held_out_error;
      report.refitted = true;
      report.converged = c->converged;
      report.bic = Bic(*c);
      report.reason =
          fmt::format("removes {:.1f} % of what {} leaves ({:.1f} standard errors); {:.1f} times the noise is left",
                      100 * more.held_out, found.second_parent->Name(), more.z, c->held_out_floors);
    }
    reports.push_back(std::move(report));
  }
  return reports;
}

// The experiment that tells the leader from its nearest rival.
void SuggestNext(const SearchResult& found, const std::string& experiment, Diagnosis* result) {
  std::vector<Explanation> rivals;
  if (found.single != found.base.get()) rivals.push_back(ExplanationOf(*found.single));
  for (const auto& child : found.first.children) {
    if (rivals.size() < 2 && child.get() != found.single && !Contains(*child, *found.single) &&
        !Contains(*found.single, *child))
      rivals.push_back(ExplanationOf(*child));
  }
  if (rivals.empty()) return;
  result->next_command = "gapscope design optimal " + experiment;
  for (const auto& rival : rivals) result->next_command += " --separate " + NameOf(rival);
  if (rivals.size() < 2) rivals.push_back({});
  result->next_separates = rivals;
}

Result<Diagnosis> Describe(const SearchResult& found, const Workbench& bench, const std::vector<double>& noise,
                           std::uint64_t seed) {
  Diagnosis result;
  const Candidate &base = *found.base, &chosen = *found.chosen;
  const Judgement judgement = Judge(found);
  result.verdict = judgement.verdict;
  result.probability = judgement.probability;
  result.evidence = judgement.evidence;
  result.nominal = found.nominal->held_out_error;
  result.refit = base.held_out_error;
  result.final = chosen.held_out_error;
  result.floor = std::min(FloorError(bench.data.held_out, noise), result.final);
  result.closed = result.refit > result.floor
                      ? std::clamp((result.refit - result.final) / (result.refit - result.floor), 0.0, 1.0)
                      : 0;
  GS_ASSIGN(result.effects, DescribeEffects(found, judgement, bench.scales));
  // Of what an `unknown` accepted too.
  if (result.verdict == Verdict::kAmbiguous || result.verdict == Verdict::kUnknown) {
    result.ambiguous = judgement.groups;
  }
  result.candidates = DescribeCandidates(found, judgement);
  result.seconds = DescribeSeconds(found);
  SuggestNext(found, bench.rig->experiment().path, &result);
  result.where = Locate(base, bench.data.held_out, seed);
  result.remains = &chosen == &base ? result.where : Locate(chosen, bench.data.held_out, seed);
  result.budget_spent = found.budget_spent;
  result.model = chosen.model;
  result.values = chosen.values;
  result.refit_model = base.model;
  result.refit_values = base.values;
  result.explanation = Explain(result);
  return result;
}

}  // namespace

std::string NameOf(const Explanation& explanation) { return explanation ? explanation->Text() : "none"; }

std::string VerdictName(Verdict verdict) {
  switch (verdict) {
    case Verdict::kNone:
      return "none";
    case Verdict::kParameters:
      return "parameters";
    case Verdict::kEffects:
      return "effects";
    case Verdict::kAmbiguous:
      return "ambiguous";
    case Verdict::kUnknown:
      return "unknown";
  }
  return "";
}

Result<Diagnosis> Diagnose(const Experiment& experiment, const DataSplit& fine, const DiagnoseOptions& options,
                           ThreadPool& pool) {
  const auto begin = std::chrono::steady_clock::now();
  DataSplit data = fine;
  for (auto* part : {&data.train, &data.held_out}) {
    for (auto& recording : *part) recording = Coarsen(recording, options.sample_s);
  }
  if (data.train.empty() || data.held_out.empty())
    return Error{.what = "diagnosis needs logs to fit and logs to judge by", .where = experiment.path};
  GS_ASSIGN(const auto model, Model::Load(experiment));
  const ScaleTable scales = EstimateScales(*model, fine.train);
  const std::vector<double> noise = SignalNoise(experiment, fine);
  Workbench bench{.rig = model->rig(),
                  .data = data,
                  .scales = scales,
                  .pool = pool,
                  .weights = {},
                  .window_s = options.window_s,
                  .max_windows = options.max_windows};
  bench.sample_s = kInfinity;
  for (const auto* part : {&fine.train, &fine.held_out}) {
    for (const auto& recording : *part) bench.sample_s = std::min(bench.sample_s, recording.timeline.median_step_s);
  }
  for (std::size_t i = 0; i < noise.size(); ++i)
    bench.weights.push_back(experiment.measured[i].scored ? 1 / noise[i] : 0);
  bench.time_step_s =
      ChooseTimeStep(*model, data.held_out, {.mode = ReplayMode::kWindows, .window_s = options.window_s}, pool).step_s;
  if (options.budget_s > 0)
    bench.deadline = begin + std::chrono::microseconds(static_cast<long long>(0.9e6 * options.budget_s));
  const Say say = options.progress ? options.progress : [](const std::string&) {};
  GS_ASSIGN(const SearchResult found, Search(bench, !data.asked, say));
  Diagnosis result;
  if (!data.asked && found.uneven) {
    // What only one log shows can be judged on no other: then windows of every log are held out instead of whole logs.
    DataSplit blocks;
    for (const auto* part : {&data.train, &data.held_out})
      blocks.train.insert(blocks.train.end(), part->begin(), part->end());
    std::sort(blocks.train.begin(), blocks.train.end(),
              [](const Recording& a, const Recording& b) { return a.log_path < b.log_path; });
    blocks.held_out = blocks.train;
    blocks.how = "every third window of each log: only some logs show the gap";
    Workbench again{.rig = model->rig(),
                    .data = blocks,
                    .scales = scales,
                    .pool = pool,
                    .weights = bench.weights,
                    .window_s = bench.window_s,
                    .time_step_s = bench.time_step_s,
                    .sample_s = bench.sample_s,
                    .max_windows = bench.max_windows,
                    .deadline = bench.deadline,
                    .by_windows = true};
    GS_ASSIGN(const SearchResult second, Search(again, false, say));
    GS_ASSIGN(result, Describe(second, again, noise, options.seed));
    for (const auto& recording : blocks.train) result.train_logs.push_back(recording.log_path);
    result.held_out_logs = result.train_logs;
    result.split = blocks.how;
  } else {
    GS_ASSIGN(result, Describe(found, bench, noise, options.seed));
    for (const auto& recording : data.train) result.train_logs.push_back(recording.log_path);
    for (const auto& recording : data.held_out) result.held_out_logs.push_back(recording.log_path);
    result.split = data.how;
  }
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace gapscope
