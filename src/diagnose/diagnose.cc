#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include "src/compare/noise.h"
#include "src/diagnose/diagnosis.h"
#include "src/diagnose/rules.h"
#include "src/diagnose/screen.h"

namespace gapscope {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Noise of each measured signal, from the log itself: the median over logs. SI.
std::vector<double> SignalNoise(const Experiment& experiment, const DataSplit& data) {
  std::vector<std::vector<double>> found(experiment.measured.size());
  for (const auto* part : {&data.train, &data.held_out}) {
    for (const auto& recording : *part) {
      for (const auto& measured : recording.measured) {
        const NoiseFloor floor = EstimateNoise(recording.time_s, measured.values, {.resolution = measured.spec.resolution});
        const double least = 1e-3 * MomentsOf(measured.values).deviation;
        const double total = std::isfinite(floor.total_std) ? floor.total_std : measured.spec.resolution;
        found[measured.index].push_back(std::max(total, least));
      }
    }
  }
  std::vector<double> noise(found.size(), 1.0);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i].empty()) continue;
    std::nth_element(found[i].begin(), found[i].begin() + static_cast<std::ptrdiff_t>(found[i].size() / 2), found[i].end());
    noise[i] = std::max(found[i][found[i].size() / 2], std::numeric_limits<double>::min());
  }
  return noise;
}

class Search {
 public:
  Search(Workbench bench, const DiagnoseOptions& options) : bench_(std::move(bench)), options_(options) {}

  Result<Diagnosis> Run(std::vector<double> noise);

 private:
  bool Late() const { return bench_.deadline && std::chrono::steady_clock::now() >= *bench_.deadline; }
  void Say(const std::string& text) const {
    if (options_.progress) options_.progress(text);
  }
  // Screens and refits what may explain more than `parent`; every refitted child goes to `pool`.
  void Explore(Candidate& parent, std::vector<std::unique_ptr<Candidate>>* children, std::vector<Screened>* screen, std::size_t refits);
  // Root mean square of residual over noise on the held-out logs.
  double Floors(const Candidate& candidate) const { return std::sqrt(2 * candidate.held_out_cost / rows_); }
  double NormalisedError(const Candidate& candidate);

  Workbench bench_;
  DiagnoseOptions options_;
  double rows_ = 1;  // scored numbers of the held-out logs
};

void Search::Explore(Candidate& parent, std::vector<std::unique_ptr<Candidate>>* children, std::vector<Screened>* screen, std::size_t refits) {
  const auto possible = parent.model->PossibleEffects();
  if (!possible.ok()) return;
  std::vector<EffectUse> uses;
  for (const auto& use : possible.value()) {
    if (IsFinding(use, *parent.model)) uses.push_back(use);
  }
  *screen = Screen(bench_, parent, uses);
  // The leaders by the score test, then the partners of the first two wherever they act.
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < screen->size() && order.size() < refits; ++i) {
    if ((*screen)[i].visible) order.push_back(i);
  }
  for (std::size_t leader = 0; leader < std::min<std::size_t>(2, order.size()); ++leader) {
    for (std::size_t i = 0; i < screen->size(); ++i) {
      const bool known = std::find(order.begin(), order.end(), i) != order.end();
      if (!known && (*screen)[i].visible && ArePartners((*screen)[order[leader]].use, (*screen)[i].use, *parent.model)) order.push_back(i);
    }
  }
  for (const std::size_t index : order) {
    if (Late()) break;
    Screened& entry = (*screen)[index];
    if (!entry.child.problem) continue;
    Say("fitting " + entry.use.Text());
    auto child = std::make_unique<Candidate>(std::move(entry.child));
    FitPoint start = child->problem->FromParent(*parent.problem, parent.point, entry.values, entry.dy);
    if (!std::isfinite(child->problem->Cost(start))) start = child->problem->FromParent(*parent.problem, parent.point, entry.values, {});
    FitCandidate(bench_, child.get(), start, 12, 2e-3);
    // A child can always do what its parent does: from there once more when it ended above it.
    if (!(child->train_cost <= parent.train_cost * 1.0005) && !Late()) {
      std::vector<double> neutral = entry.values;
      const auto placed = child->model->EffectParameters(entry.use, bench_.scales);
      for (const auto& p : placed.value()) neutral[child->model->IndexOf(p.name)] = p.neutral + 0.02 * ((p.neutral == p.high ? p.low : p.high) - p.neutral);
      FitCandidate(bench_, child.get(), child->problem->FromParent(*parent.problem, parent.point, neutral, {}), 12, 2e-3);
    }
    ScoreCandidate(bench_, child.get());
    children->push_back(std::move(child));
  }
  std::stable_sort(children->begin(), children->end(), [](const auto& a, const auto& b) { return a->held_out_cost < b->held_out_cost; });
  // The leaders once more to the end: an unconverged rival looks exactly like a rejected one.
  for (std::size_t i = 0; i < std::min<std::size_t>(3, children->size()) && !Late(); ++i) {
    Candidate& leader = *(*children)[i];
    if (i > 0 && leader.held_out_cost > 1.5 * children->front()->held_out_cost) break;
    FitCandidate(bench_, &leader, leader.point, 15, 2e-4);
    ScoreCandidate(bench_, &leader);
  }
  std::stable_sort(children->begin(), children->end(), [](const auto& a, const auto& b) { return a->held_out_cost < b->held_out_cost; });
}

double Search::NormalisedError(const Candidate& candidate) {
  FitOptions options = bench_.Options(*candidate.model, false);
  options.fit_shift = false;
  options.shift_s = candidate.shift_s;
  options.weights.clear();
  FitProblem problem(*candidate.model, bench_.data.held_out, options, candidate.values, bench_.pool);
  FitPoint point = problem.Start();
  if (!std::isfinite(problem.Cost(point))) return std::numeric_limits<double>::infinity();
  point = Solve(problem, point, {.max_iterations = 4, .tolerance = 1e-3, .coarse_step = 0.01, .fine_step = 0.01}).point;
  return ReplayError(problem.Predict(point));
}

// Replaces the best of `children` by a simpler one that explains the held-out logs as well.
Candidate* Simplest(const std::vector<std::unique_ptr<Candidate>>& children, const Candidate& parent) {
  if (children.empty()) return nullptr;
  Candidate* best = children.front().get();
  for (const auto& child : children) {
    if (child.get() == best || !Contains(*best, *child)) continue;
    const PairedGain more = CompareCandidates(*child, *best);
    const PairedGain all = CompareCandidates(parent, *best);
    if (more.z < kNestedZ || more.gain < kNestedShare * all.gain) best = child.get();
  }
  return best;
}

Result<Diagnosis> Search::Run(std::vector<double> noise) {
  Diagnosis result;
  // Baseline.
  Say("refitting the baseline");
  GS_ASSIGN(Candidate base, MakeCandidate(bench_, {}));
  FitPoint start = base.problem->Start();
  if (!std::isfinite(base.problem->Cost(start))) {
    return Error{.what = "the base model cannot be simulated along these logs, even in windows", .where = bench_.experiment.path, .cure = "check units, signs and nominal parameters with `gapscope replay --mode windows`"};
  }
  Candidate nominal;
  GS_ASSIGN(nominal, MakeCandidate(bench_, {}));
  nominal.point = start;
  nominal.values = nominal.model->Nominal();
  ScoreCandidate(bench_, &nominal);
  FitCandidate(bench_, &base, start, 30, 2e-4);
  ScoreCandidate(bench_, &base);
  rows_ = 0;
  {
    FitOptions options = bench_.Options(*base.model, false);
    FitProblem problem(*base.model, bench_.data.held_out, options, base.values, bench_.pool);
    rows_ = static_cast<double>(std::max<std::size_t>(1, problem.residuals()));
  }

  // Residual over noise, root mean square, on both sides of the split.
  const double train_floors = std::sqrt(2 * base.train_cost / static_cast<double>(std::max<std::size_t>(1, base.problem->residuals())));
  constexpr double kUneven = 1.5;
  result.uneven = !bench_.by_windows && std::max(train_floors / Floors(base), Floors(base) / train_floors) > kUneven;
  if (result.uneven && !bench_.data.asked) return result;

  // First effect.
  Say("screening");
  std::vector<std::unique_ptr<Candidate>> singles;
  std::vector<Screened> screen;
  Explore(base, &singles, &screen, 5);
  std::vector<std::unique_ptr<Candidate>> pairs;
  std::vector<Screened> second_screen;
  Candidate* best = Simplest(singles, base);
  const PairedGain first_gain = best ? CompareCandidates(base, *best) : PairedGain{};
  const bool first = best && first_gain.relative > kFirstGain && first_gain.z > kFirstZ;
  Candidate* chosen = first ? best : &base;
  Candidate* single = chosen;

  // Second effect, on the leader.
  if (first && Floors(*best) > kRemains && !Late()) {
    Say("looking for a second effect");
    Explore(*best, &pairs, &second_screen, 4);
    if (Candidate* more = Simplest(pairs, *best)) {
      const PairedGain gain = CompareCandidates(*best, *more);
      const double excess = best->held_out_cost - 0.5 * rows_;
      if (gain.relative > kSecondGain && gain.z > kSecondZ && gain.gain > kSecondExcess * excess) chosen = more;
    }
    // Backward: does the first one still matter?
    if (chosen->effects.size() == 2 && !Late()) {
      GS_ASSIGN(Candidate other, MakeCandidate(bench_, {chosen->effects[1]}));
      std::vector<double> values = other.model->Nominal();
      for (std::size_t i = 0; i < values.size(); ++i) {
        if (const int index = chosen->model->IndexOf(other.model->parameters()[i].name); index >= 0) values[i] = chosen->values[index];
      }
      FitCandidate(bench_, &other, other.problem->FromParent(*base.problem, base.point, values, {}), 20, 5e-4);
      ScoreCandidate(bench_, &other);
      const PairedGain matters = CompareCandidates(other, *chosen);
      singles.push_back(std::make_unique<Candidate>(std::move(other)));
      if (matters.relative < kSecondGain || matters.z < kSecondZ) {
        chosen = single = singles.back().get();
      }
    }
  }
  result.budget_spent = Late();

  // Errors.
  result.nominal = NormalisedError(nominal);
  result.refit = NormalisedError(base);
  result.final = chosen == &base ? result.refit : NormalisedError(*chosen);
  double floor = 0, signals = 0;
  for (const auto& recording : bench_.data.held_out) {
    for (const auto& measured : recording.measured) {
      if (!measured.spec.scored) continue;
      const double share = noise[measured.index] / MomentsOf(measured.values).deviation;
      if (std::isfinite(share)) floor += share * share, signals += 1;
    }
  }
  result.floor = std::min(std::sqrt(floor / std::max(1.0, signals)), result.final);
  result.closed = result.refit > result.floor ? std::clamp((result.refit - result.final) / (result.refit - result.floor), 0.0, 1.0) : 0;
  result.floors_left = Floors(*chosen);

  // Verdict.
  const double left = Floors(*chosen), before = Floors(base);
  const double removed = before > 1 ? (before - left) / (before - std::min(1.0, left)) : 0;
  std::vector<const Candidate*> rivals;
  if (chosen != &base) {
    const auto& field = chosen->effects.size() == 2 ? pairs : singles;
    const Candidate& parent = chosen->effects.size() == 2 ? *single : base;
    for (const auto& rival : field) {
      if (rival.get() == chosen || Contains(*rival, *chosen) || Contains(*chosen, *rival)) continue;
      const PairedGain lead = CompareCandidates(*rival, *chosen);
      const PairedGain gain = CompareCandidates(parent, *chosen);
      if (lead.gain < kRivalShare * gain.gain && (lead.z < kRivalZ || lead.gain < kRivalEqual * gain.gain)) rivals.push_back(rival.get());
    }
  }
  const bool unexplained = left > kUnknownFloors && removed < kUnknownRemoved;
  if (unexplained) {
    result.verdict = Verdict::kUnknown;
  } else if (chosen == &base) {
    const PairedGain retuned = CompareCandidates(nominal, base);
    result.verdict = retuned.relative > kRetuned && retuned.z > kFirstZ ? Verdict::kParameters : Verdict::kNone;
  } else {
    result.verdict = rivals.empty() ? Verdict::kEffects : Verdict::kAmbiguous;
  }

  // Probabilities over single explanations: the evidence of each, in units of what no-effect cases show.
  std::vector<const Candidate*> field = {&base};
  for (const auto& child : singles) field.push_back(child.get());
  const Candidate* leader = single;
  std::vector<double> odds;
  for (const Candidate* c : field) {
    if (c == leader) {
      odds.push_back(1);
      continue;
    }
    const PairedGain lead = CompareCandidates(*c, *leader);
    const double z = std::max(0.0, lead.z), share = c == &base ? lead.relative / kFirstGain : std::max(0.0, lead.relative) / kProbabilityShare;
    odds.push_back(std::exp(-0.5 * z * std::min(z, 4.0)) + 0.3 * std::exp(-share));
  }
  // A sum that includes simpler or richer members of the leader's own family counts them with it.
  const double total = std::accumulate(odds.begin(), odds.end(), 0.0);
  const auto probability_of = [&](const Candidate* c) {
    const auto found = std::find(field.begin(), field.end(), c);
    return found == field.end() ? 0.0 : odds[static_cast<std::size_t>(found - field.begin())] / total;
  };
  result.probability = std::min(0.99, unexplained ? 0.6 + 0.35 * std::min(1.0, left / kUnknownFloors - 1) : probability_of(leader));
  if (result.verdict == Verdict::kAmbiguous) result.probability = 0.8;
  if (result.budget_spent) result.probability *= 0.8;

  // Accepted effects, their parameters and shares.
  if (chosen != &base) {
    const Uncertainty uncertainty = EstimateUncertainty(*chosen->problem, chosen->point, *chosen->model, 0.01);
    double gap = result.refit - result.final;
    for (std::size_t e = 0; e < chosen->effects.size(); ++e) {
      const EffectUse& use = chosen->effects[e];
      FoundEffect found{.use = use, .probability = e == 0 ? probability_of(single) : 0, .error_before = result.refit, .error_after = result.final, .share_of_gap = 1};
      GS_ASSIGN(const auto placed, chosen->model->EffectParameters(use, bench_.scales));
      for (const auto& p : placed) {
        for (const auto& tuned : uncertainty.tuned) {
          if (chosen->model->parameters()[tuned.index].name == p.name) found.parameters.push_back({p.key, p.unit, tuned.value, tuned.low, tuned.high});
        }
      }
      result.effects.push_back(std::move(found));
    }
    if (chosen->effects.size() == 2 && gap > 0) {
      // Alone, and after the other one: the mean of both orders (Shapley).
      std::vector<double> alone(2, result.refit);
      for (int e = 0; e < 2; ++e) {
        for (const auto& s : singles) {
          if (s->effects.front() == chosen->effects[static_cast<std::size_t>(e)]) alone[static_cast<std::size_t>(e)] = NormalisedError(*s);
        }
      }
      for (std::size_t e = 0; e < 2; ++e) {
        const double first_added = result.refit - alone[e], last_added = alone[1 - e] - result.final;
        result.effects[e].share_of_gap = 0.5 * (first_added + last_added) / gap;
        result.effects[e].error_before = alone[1 - e];
      }
      const PairedGain gain = CompareCandidates(*single, *chosen);
      result.effects[1].probability = std::min(0.97, 1 - std::exp(-0.5 * std::max(0.0, gain.z)));
      result.effects[0].probability = std::max(result.effects[0].probability, 0.5);
      result.probability *= result.effects[1].probability;
    }
  }
  if (result.verdict == Verdict::kAmbiguous) {
    std::vector<std::string> group = {chosen->effects.back().Text()};
    for (const Candidate* rival : rivals) group.push_back(rival->effects.back().Text());
    result.ambiguous.push_back(std::move(group));
  }

  // Every effect that was tried, and why not.
  std::set<std::string> named;
  for (const Candidate* c : field) {
    CandidateReport report{.name = c->Name(), .probability = probability_of(c), .refitted = true, .converged = c->converged};
    report.held_out_error = NormalisedError(*c);
    const PairedGain gain = CompareCandidates(base, *c);
    for (const auto& s : screen) {
      if (!c->effects.empty() && s.use == c->effects.front()) report.screen_drop = s.drop, report.absorbed = s.absorbed;
    }
    report.reason = Reason(*c, base, *chosen, gain, CompareCandidates(*c, *chosen));
    named.insert(report.name);
    result.candidates.push_back(std::move(report));
  }
  for (const auto& s : screen) {
    if (named.contains(s.use.Text())) continue;
    result.candidates.push_back({.name = s.use.Text(), .held_out_error = kNan, .screen_drop = s.drop, .absorbed = s.absorbed,
                                 .reason = !s.visible ? "cannot be seen in these logs: the base model's parameters imitate it fully"
                                                      : fmt::format("the score test promises {:.2g} % of the error at most, less than the leaders", 100 * s.drop)});
  }
  std::stable_sort(result.candidates.begin(), result.candidates.end(), [](const auto& a, const auto& b) { return a.probability > b.probability; });

  // What next: the experiment that tells the leader from its nearest rival.
  const Candidate* rival = nullptr;
  for (const auto& child : singles) {
    if (child.get() != single && !Contains(*child, *single) && !Contains(*single, *child) && (!rival || child->held_out_cost < rival->held_out_cost)) rival = child.get();
  }
  if (single != &base || rival) {
    const EffectUse a = single != &base ? single->effects.front() : rival->effects.front();
    result.next_command = NextExperiment(a, rival ? rival->effects.front() : a, *base.model, bench_.scales);
    result.next_separates = {a.Text(), rival && single != &base ? rival->effects.front().Text() : "none"};
  }

  // Where the refitted baseline's error lies.
  {
    FitOptions options = bench_.Options(*base.model, false);
    options.fit_shift = false;
    options.shift_s = base.shift_s;
    FitProblem problem(*base.model, bench_.data.held_out, options, base.values, bench_.pool);
    const auto logs = problem.Predict(problem.Start());
    for (std::size_t l = 0; l < logs.size(); ++l) {
      const Recording& recording = bench_.data.held_out[l];
      for (std::size_t s = 0; s < logs[l].signals.size(); ++s) {
        const SignalTrace& trace = logs[l].signals[s];
        if (!trace.scored) continue;
        ConditionInput input{.signal = trace.signal, .time_s = logs[l].time_s, .measured = trace.measured, .predicted = trace.predicted};
        std::vector<double> speed;
        if (trace.kind == SignalKind::kPosition) {
          for (std::size_t row = 0; row < recording.rows(); ++row) speed.push_back(FitLocally(recording, recording.measured[s], row, kInitialFitHalfWidth_s).slope);
          input.speed = speed;
          input.angle = trace.measured;
        }
        if (!recording.commands.empty()) input.command = recording.commands.front().values;
        for (auto& share : LocateError(input, {.seed = options_.seed})) result.where.push_back(std::move(share));
      }
      break;  // the first held-out log stands for all: shares of several logs do not add up
    }
    result.where = MostTelling(result.where, {.limit = 12});
  }
  result.model = chosen->model;
  result.values = chosen->values;
  result.explanation = Explain(result, before);
  return result;
}

}  // namespace

std::string VerdictName(Verdict verdict) {
  switch (verdict) {
    case Verdict::kNone: return "none";
    case Verdict::kParameters: return "parameters";
    case Verdict::kEffects: return "effects";
    case Verdict::kAmbiguous: return "ambiguous";
    case Verdict::kUnknown: return "unknown";
  }
  return "";
}

Result<Diagnosis> Diagnose(const Experiment& experiment, const DataSplit& data, const DiagnoseOptions& options, ThreadPool& pool) {
  const auto begin = std::chrono::steady_clock::now();
  if (data.train.empty() || data.held_out.empty()) return Error{.what = "diagnosis needs logs to fit and logs to judge by", .where = experiment.path};
  GS_ASSIGN(const auto model, Model::Build(experiment));
  const ScaleTable scales = EstimateScales(*model, data.train);
  const std::vector<double> noise = SignalNoise(experiment, data);
  Workbench bench{.experiment = experiment, .data = data, .scales = scales, .pool = pool, .weights = {}, .window_s = options.window_s, .max_windows = options.max_windows};
  for (std::size_t i = 0; i < noise.size(); ++i) bench.weights.push_back(experiment.measured[i].scored ? 1 / noise[i] : 0);
  bench.time_step_s = ChooseTimeStep(*model, data.held_out, {.mode = ReplayMode::kWindows, .window_s = options.window_s}, pool).step_s;
  if (options.budget_s > 0) bench.deadline = begin + std::chrono::microseconds(static_cast<long long>(0.9e6 * options.budget_s));
  GS_ASSIGN(Diagnosis result, Search(bench, options).Run(noise));
  // What only one log shows can be judged on no other: then windows of every log are held out instead of whole logs.
  DataSplit blocks;
  if (!data.asked && result.uneven) {
    for (const auto* part : {&data.train, &data.held_out}) blocks.train.insert(blocks.train.end(), part->begin(), part->end());
    std::sort(blocks.train.begin(), blocks.train.end(), [](const Recording& a, const Recording& b) { return a.log_path < b.log_path; });
    blocks.held_out = blocks.train;
    blocks.how = "every third window of each log: only some logs show the gap";
    Workbench again{.experiment = experiment, .data = blocks, .scales = scales, .pool = pool, .weights = bench.weights, .window_s = options.window_s, .time_step_s = bench.time_step_s,
                    .max_windows = options.max_windows, .deadline = bench.deadline, .by_windows = true};
    GS_ASSIGN(result, Search(again, options).Run(noise));
  }
  if (!blocks.how.empty()) {
    for (const auto& recording : blocks.train) result.train_logs.push_back(recording.log_path);
    result.held_out_logs = result.train_logs;
    result.split = blocks.how;
    result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return result;
  }
  for (const auto& recording : data.train) result.train_logs.push_back(recording.log_path);
  for (const auto& recording : data.held_out) result.held_out_logs.push_back(recording.log_path);
  result.split = data.how;
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace gapscope
