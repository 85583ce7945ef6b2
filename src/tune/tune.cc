#include "src/tune/tune.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "src/core/statistics.h"
#include "src/fit/journal.h"
#include "src/tune/job_key.h"

namespace gapscope {
namespace {

constexpr double kAgree = 0.01;  // starts agree when their costs differ by less than this share

FitOptions MakeFitOptions(const TuneOptions& options, const std::vector<int>& free, ObjectiveKind objective) {
  return {.free = free,
          .objective = objective,
          .window_s = options.window_s,
          .time_step_s = options.time_step_s,
          .steps = options.steps,
          .fit_offsets = options.fit_offsets,
          .fit_shift = options.fit_shift,
          .fit_states = options.fit_states,
          .normalization = options.normalization,
          .huber = options.huber};
}

// Everything that decides the fit's numbers.
std::uint64_t JobKey(const Model& model, const DataSplit& data, const std::vector<double>& start,
                     const TuneOptions& options) {
  Hasher hasher;
  AddModel(model, &hasher);
  hasher.Numbers(start);
  for (const auto* part : {&data.train, &data.held_out}) {
    hasher.Number(static_cast<double>(part->size()));
    for (const auto& recording : *part) AddRecording(recording, &hasher);
  }
  const SolveOptions& solve = options.solve;
  const double numbers[] = {static_cast<double>(options.objective),
                            options.window_s,
                            static_cast<double>(options.fit_offsets),
                            static_cast<double>(options.fit_shift),
                            static_cast<double>(options.fit_states),
                            static_cast<double>(options.normalization),
                            options.huber,
                            options.time_step_s,
                            static_cast<double>(options.starts),
                            solve.tolerance,
                            solve.coarse_step,
                            solve.fine_step,
                            solve.damping,
                            static_cast<double>(solve.central),
                            static_cast<double>(solve.secant),
                            static_cast<double>(solve.max_iterations),
                            static_cast<double>(solve.seed)};
  hasher.Text(solve.optimizer).Numbers(numbers);
  for (const std::vector<int>* indices : {&options.free, &options.if_known}) {
    hasher.Number(static_cast<double>(indices->size()));
    hasher.Bytes(indices->data(), sizeof(int) * indices->size());
  }
  return hasher.value();
}

// A random start inside the middle of the bounds.
std::vector<double> RandomStart(const SearchSpace& space, std::mt19937_64& random) {
  std::uniform_real_distribution<double> share(0.15, 0.85);
  Eigen::VectorXd y(space.size());
  for (Eigen::Index k = 0; k < y.size(); ++k)
    y[k] = space.low()[k] + share(random) * (space.high()[k] - space.low()[k]);
  return std::vector<double>(y.begin(), y.end());
}

// A problem with its objective, journaled where there is a journal.
struct Stage {
  Stage(const Model& model, const DataSplit& data, const FitOptions& options, const std::vector<double>& start,
        ThreadPool& pool, Journal* journal_or_null)
      : problem(model, data.train, options, start, pool), plain(problem), journal(journal_or_null) {
    if (journal) journaled.emplace(plain, *journal);
  }
  Objective& objective() { return journaled ? static_cast<Objective&>(*journaled) : plain; }
  SolveResult SolveFrom(const FitPoint& point, const SolveOptions& options) {
    return Solve({.problem = problem, .objective = objective(), .journal = journal}, point, options);
  }

  FitProblem problem;
  ProblemObjective plain;
  std::optional<JournaledObjective> journaled;
  Journal* journal;
};

// What all starts of one fit share.
struct Fit {
  const Model& model;
  const DataSplit& data;
  const std::vector<double>& start;
  const TuneOptions& options;
  std::vector<int> free;
  ThreadPool& pool;
  Journal* journal;

  std::unique_ptr<Stage> MakeStage(ObjectiveKind objective) const {
    return std::make_unique<Stage>(model, data, MakeFitOptions(options, free, objective), start, pool, journal);
  }
};

// Where one start led.
struct Found {
  std::unique_ptr<Stage> stage;  // the last one
  SolveResult result;
  Work work;
};

// A point whose windows' states are solved, and what is left there.
struct Solved {
  FitPoint point;
  Evaluation left;
};

// Weighs the states' priors by what is left: the model's misfit, once the states are solved. Before, it is mostly the
// starts', which a prior of that size would hold where they are.
Solved Weigh(FitProblem& problem, const FitPoint& solved) {
  Solved result{.point = solved, .left = problem.Evaluate(solved, Keep::kResiduals)};
  if (std::isfinite(result.left.cost)) problem.WeighStates(result.left.residuals);
  return result;
}

// The only way to weigh a point that no solve has ended at.
Solved SolveStatesAndWeigh(FitProblem& problem, Objective& objective, const FitPoint& point, Work* work) {
  return Weigh(problem, SolveStates(problem, objective, point, 3, work));
}

// The free runs beside the windows, from where the windows ended; nothing where they cannot be simulated there.
std::optional<Found> FitBoth(const Fit& fit, const Eigen::VectorXd& y) {
  Found both{.stage = fit.MakeStage(ObjectiveKind::kBoth), .result = {}, .work = {}};
  FitProblem& problem = both.stage->problem;
  FitPoint joint = problem.Start();
  joint.y = y;
  const Evaluation first = both.stage->objective().Evaluate(joint, Keep::kCost);
  both.work += first.work;
  both.result.cost = kInfinity;
  if (!std::isfinite(first.cost)) return both;
  // Windows come log by log, each log's free run last: their states are found again from the log.
  const Solved found = SolveStatesAndWeigh(problem, both.stage->objective(), joint, &both.work);
  problem.SetHuberThreshold(found.left.residuals);
  both.result = both.stage->SolveFrom(found.point, fit.options.solve);
  both.work += both.result.work;
  return both;
}

// Windows first: they converge from far; the free run then sees what is slow, when it can be simulated at all.
// `random`: search coordinates of the parameters; none: the given values.
Found FitFrom(const Fit& fit, const std::optional<std::vector<double>>& random) {
  const ObjectiveKind asked = fit.options.objective;
  Found found{.stage = fit.MakeStage(asked == ObjectiveKind::kFreeRun ? asked : ObjectiveKind::kWindows),
              .result = {},
              .work = {}};
  FitPoint point = found.stage->problem.Start();
  if (random) std::copy(random->begin(), random->end(), point.y.begin());
  found.result = found.stage->SolveFrom(point, fit.options.solve);
  found.work += found.result.work;
  if (found.result.termination == Termination::kNotSimulated) return found;
  if (asked != ObjectiveKind::kBoth) {
    if (fit.options.huber > 0 || fit.options.fit_states) {
      FitProblem& problem = found.stage->problem;
      problem.SetHuberThreshold(Weigh(problem, found.result.point).left.residuals);
      found.result = found.stage->SolveFrom(found.result.point, fit.options.solve);
      found.work += found.result.work;
    }
    return found;
  }
  std::optional<Found> both = FitBoth(fit, found.result.point.y);
  both->work += found.work;
  if (both->result.termination != Termination::kNotSimulated && std::isfinite(both->result.cost))
    return std::move(*both);
  found.work = both->work;
  return found;
}

// The parameters that are fitted: what is free, and of `options.if_known` what the logs know beside it.
std::vector<int> ChooseFree(const Fit& fit, TuneSummary* summary) {
  const std::vector<int>& asked = fit.options.if_known;
  std::vector<int> all = fit.free;
  if (asked.empty()) return all;
  all.insert(all.end(), asked.begin(), asked.end());
  Stage stage(fit.model, fit.data, MakeFitOptions(fit.options, all, ObjectiveKind::kWindows), fit.start, fit.pool,
              nullptr);
  Work work;
  const Solved at = SolveStatesAndWeigh(stage.problem, stage.objective(), stage.problem.Start(), &work);
  const Linearization linear = stage.objective().Linearize(
      at.point, {.step = fit.options.solve.fine_step, .columns = DifferenceOptions::Columns::kCentral});
  work += linear.work;
  summary->evaluations += work.evaluations, summary->replays += work.replays;
  const std::vector<int> known = linear.valid ? KnownOf(stage.problem, linear, asked) : std::vector<int>{};
  for (const int index : asked) {
    if (std::ranges::find(known, index) != known.end()) continue;
    summary->left_frozen.push_back(index);
    std::erase(all, index);
  }
  return all;
}

void Score(const Model& model, const DataSplit& data, const TuneOptions& options, ThreadPool& pool,
           TuneSummary* summary) {
  const ReplayMode mode = model.experiment().replay.mode;
  const FixedParameters tuned{summary->values, summary->stamps};
  summary->error_nominal =
      ReplayError(Evaluate(model, data.held_out, {model.Nominal(), StampShift{}}, mode, options, pool));
  summary->train = Evaluate(model, data.train, tuned, mode, options, pool);
  summary->held_out = Evaluate(model, data.held_out, tuned, mode, options, pool);
  summary->error_train = ReplayError(summary->train);
  summary->error_held_out = ReplayError(summary->held_out);
}

// All starts; the best one's values, costs and work are in the summary.
Found FitFromAll(const Fit& fit, TuneSummary* summary) {
  std::mt19937_64 random(fit.options.solve.seed + 1);
  const SearchSpace space(fit.model.parameters(), fit.free, fit.start, false, false);
  Found best;
  for (int s = 0; s < std::max(1, fit.options.starts); ++s) {
    if (s > 0 && IsLate(fit.options.solve.deadline)) break;
    std::optional<std::vector<double>> from;
    if (s > 0) from = RandomStart(space, random);
    Found found = FitFrom(fit, from);
    summary->evaluations += found.work.evaluations, summary->replays += found.work.replays;
    summary->start_costs.push_back(found.result.cost);
    if (!best.stage || (std::isfinite(found.result.cost) && found.result.cost < best.result.cost))
      best = std::move(found);
  }
  summary->values = best.stage->problem.Values(best.result.point);
  summary->termination = fit.options.solve.deadline.stopped() ? Termination::kInterrupted : best.result.termination;
  for (const double cost : summary->start_costs)
    summary->starts_agree = summary->starts_agree && cost <= best.result.cost * (1 + kAgree);
  summary->stamps = best.stage->problem.Stamps(best.result.point);
  return best;
}

}  // namespace

std::vector<LogReplay> Evaluate(const Model& model, const std::vector<Recording>& recordings,
                                const FixedParameters& fixed, ReplayMode mode, const TuneOptions& options,
                                ThreadPool& pool) {
  if (recordings.empty()) return {};
  FitOptions fit =
      MakeFitOptions(options, {}, mode == ReplayMode::kWindows ? ObjectiveKind::kWindows : ObjectiveKind::kFreeRun);
  fit.lead_in_s = 0;
  fit.fit_shift = !fixed.stamps;
  fit.stamps = fixed.stamps.value_or(StampShift{});
  FitProblem problem(model, recordings, fit, fixed.values, pool);
  ProblemObjective objective(problem);
  Work work;
  Solved found = SolveStatesAndWeigh(problem, objective, problem.Start(), &work);
  if (std::isfinite(found.left.cost))
    found.point = Solve(problem, found.point, {.max_iterations = 8, .tolerance = 1e-3, .coarse_step = 0.01}).point;
  if (fixed.found) *fixed.found = problem.Stamps(found.point);
  return problem.Predict(found.point);
}

TuneOptions DefaultTuneOptions(const ReplayDefaults& replay, int starts, unsigned long seed) {
  TuneOptions options{.window_s = replay.window_s, .starts = starts};
  options.solve.seed = seed;
  if (replay.mode == ReplayMode::kWindows) options.objective = ObjectiveKind::kWindows;
  return options;
}

Result<TuneSummary> Tune(const Model& model, const DataSplit& data, const std::vector<double>& start,
                         const TuneOptions& asked, ThreadPool& pool) {
  const auto begin = std::chrono::steady_clock::now();
  const auto since = [](const auto& when) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - when).count();
  };
  TuneOptions options = asked;
  const std::vector<int> free = options.free.empty() ? model.FreeParameters() : options.free;
  if (free.empty() && options.if_known.empty())
    return Error{.what = "no parameter is free", .where = model.experiment().path, .cure = "use --free NAME"};
  TuneSummary summary{.optimizer = options.solve.optimizer, .values = start, .split = data.how};
  if (options.time_step_s <= 0) {
    const ReplayOptions replay{.mode = ReplayMode::kWindows, .window_s = options.window_s, .values = start};
    options.time_step_s = ChooseTimeStep(model, data.train, replay, pool).step_s;
  }
  summary.time_step_s = options.time_step_s;
  std::unique_ptr<Journal> journal;
  if (!options.journal.empty()) {
    GS_ASSIGN(journal, Journal::Open(options.journal, JobKey(model, data, start, options), options.resume));
  }
  const auto solve_begin = std::chrono::steady_clock::now();
  Fit fit{.model = model,
          .data = data,
          .start = start,
          .options = options,
          .free = free,
          .pool = pool,
          .journal = journal.get()};
  fit.free = ChooseFree(fit, &summary);
  if (fit.free.empty())
    return Error{.what = "these logs know none of the numbers that may be tuned",
                 .where = model.experiment().path,
                 .cure = "use --free NAME, or logs that move the bodies under 'inertia'"};
  const Found best = FitFromAll(fit, &summary);
  if (best.result.termination == Termination::kNotSimulated) {
    return Error{.what = "the model cannot be simulated at the start of the fit",
                 .where = model.experiment().path,
                 .cure = "check the parameters' nominal values, or use shorter windows (--window)"};
  }
  summary.solve_s = since(solve_begin);
  const DifferenceOptions differences{.step = options.solve.fine_step, .columns = DifferenceOptions::Columns::kCentral};
  const FitPoint& point = best.result.point;
  Uncertainty uncertainty =
      EstimateUncertainty(best.stage->problem, point, best.stage->objective().Linearize(point, differences));
  summary.tuned = std::move(uncertainty.tuned);
  summary.flat = std::move(uncertainty.flat);
  summary.correlated = std::move(uncertainty.correlated);
  summary.spread = std::move(uncertainty.spread);
  if (journal && !journal->status().ok()) summary.warnings.push_back(journal->status().error().Text());
  Score(model, data, options, pool, &summary);
  summary.wall_s = since(begin);
  return summary;
}

}  // namespace gapscope
