#include "src/tune/tune.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "src/core/file.h"
#include "src/tune/journal.h"

namespace gapscope {
namespace {

constexpr double kSingleLogHeldOut = 0.3;
constexpr double kAgree = 0.01;  // starts agree when their costs differ by less than this share

FitOptions MakeFitOptions(const TuneOptions& options, const std::vector<int>& free, double time_step_s) {
  return {.free = free,
          .objective = options.objective,
          .window_s = options.window_s,
          .time_step_s = time_step_s,
          .fit_offsets = options.fit_offsets,
          .fit_shift = options.fit_shift,
          .fit_states = options.fit_states,
          .normalization = options.normalization,
          .huber = options.huber};
}

// A random start inside the middle of the bounds.
FitPoint RandomStart(const FitProblem& problem, std::mt19937_64& random) {
  FitPoint point = problem.Start();
  std::uniform_real_distribution<double> share(0.15, 0.85);
  for (std::size_t i = 0; i < problem.coordinates().size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    point.y[k] = problem.low()[k] + share(random) * (problem.high()[k] - problem.low()[k]);
  }
  return point;
}

std::uint64_t JobKey(const Model& model, const DataSplit& data, const std::vector<double>& start,
                     const TuneOptions& options) {
  std::uint64_t key = Hash(start.data(), sizeof(double) * start.size());
  const auto add = [&](const std::string& text) { key = Hash(text.data(), text.size(), key); };
  for (const auto& p : model.parameters()) add(p.name);
  for (const auto* part : {&data.train, &data.held_out}) {
    for (const auto& recording : *part) {
      for (const auto& measured : recording.measured)
        key = Hash(measured.values.data(), sizeof(double) * measured.values.size(), key);
      for (const auto& command : recording.commands)
        key = Hash(command.values.data(), sizeof(double) * command.values.size(), key);
      key = Hash(recording.time_s.data(), sizeof(double) * recording.time_s.size(), key);
    }
  }
  const double numbers[] = {static_cast<double>(options.objective),
                            options.window_s,
                            static_cast<double>(options.fit_offsets),
                            static_cast<double>(options.fit_shift),
                            static_cast<double>(options.fit_states),
                            options.huber,
                            options.time_step_s,
                            static_cast<double>(options.starts),
                            static_cast<double>(options.solve.optimizer),
                            options.solve.tolerance,
                            static_cast<double>(options.normalization),
                            static_cast<double>(options.solve.max_iterations),
                            static_cast<double>(options.solve.seed)};
  key = Hash(numbers, sizeof numbers, key);
  return Hash(options.free.data(), sizeof(int) * options.free.size(), key);
}

}  // namespace

Recording Slice(const Recording& recording, std::size_t begin, std::size_t end) {
  Recording part = recording;
  const auto cut = [&](std::vector<double>& values) {
    values = std::vector<double>(values.begin() + static_cast<std::ptrdiff_t>(begin),
                                 values.begin() + static_cast<std::ptrdiff_t>(end));
  };
  cut(part.time_s);
  const double shift = part.time_s.front();
  for (double& t : part.time_s) t -= shift;
  for (auto& command : part.commands) cut(command.values);
  for (auto& measured : part.measured) cut(measured.values);
  return part;
}

DataSplit SplitData(std::vector<Recording> recordings, const std::vector<std::size_t>& held_out) {
  DataSplit split;
  std::vector<char> keep(recordings.size(), 0);
  for (const std::size_t index : held_out) keep[index] = 1;
  if (held_out.empty() && recordings.size() == 1) {
    const Recording& only = recordings.front();
    std::size_t row = 0;
    while (row < only.rows() && only.time_s[row] < (1 - kSingleLogHeldOut) * only.duration_s()) ++row;
    row = std::clamp<std::size_t>(row, 2, only.rows() - 2);
    split.train.push_back(Slice(only, 0, row));
    split.held_out.push_back(Slice(only, row, only.rows()));
    split.how = "the last 30 % of the only log's time";
    return split;
  }
  if (held_out.empty()) {
    for (std::size_t i = 1; i < recordings.size(); i += 3) keep[i] = 1;
  }
  split.asked = !held_out.empty();
  std::size_t count = 0;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    count += keep[i];
    (keep[i] ? split.held_out : split.train).push_back(std::move(recordings[i]));
  }
  split.how = held_out.empty() ? "every third log, from the second on (" + std::to_string(count) + " of " +
                                     std::to_string(recordings.size()) + ")"
                               : "as asked (" + std::to_string(count) + ")";
  return split;
}

std::vector<LogReplay> Evaluate(const Model& model, const std::vector<Recording>& recordings,
                                const std::vector<double>& values, std::optional<double> shift_s, ReplayMode mode,
                                const TuneOptions& options, ThreadPool& pool) {
  if (recordings.empty()) return {};
  FitOptions fit = MakeFitOptions(options, {}, options.time_step_s);
  fit.objective = mode == ReplayMode::kWindows ? Objective::kWindows : Objective::kFreeRun;
  fit.lead_in_s = 0;
  fit.fit_shift = !shift_s;
  fit.shift_s = shift_s.value_or(0);
  FitProblem problem(model, recordings, fit, values, pool);
  FitPoint point = problem.Start();
  SolveOptions solve{.max_iterations = 8, .tolerance = 1e-3, .coarse_step = 0.01};
  if (std::isfinite(problem.Cost(point))) {
    problem.WeighStates(point);
    point = Solve(problem, point, solve).point;
  }
  return problem.Predict(point);
}

Result<TuneSummary> Tune(const Model& model, const DataSplit& data, const std::vector<double>& start,
                         const TuneOptions& asked, ThreadPool& pool) {
  const auto begin = std::chrono::steady_clock::now();
  TuneOptions options = asked;
  std::vector<int> free = options.free;
  if (free.empty()) {
    for (std::size_t i = 0; i < model.parameters().size(); ++i) {
      if (!model.parameters()[i].frozen && model.parameters()[i].low < model.parameters()[i].high)
        free.push_back(static_cast<int>(i));
    }
  }
  if (free.empty())
    return Error{.what = "no parameter is free", .where = model.experiment().path, .cure = "use --free NAME"};
  TuneSummary summary{
      .optimizer = OptimizerNames()[static_cast<int>(options.solve.optimizer)], .values = start, .split = data.how};
  if (options.time_step_s <= 0) {
    options.time_step_s =
        ChooseTimeStep(model, data.train, {.mode = ReplayMode::kWindows, .window_s = options.window_s, .values = start},
                       pool)
            .step_s;
  }
  summary.time_step_s = options.time_step_s;
  std::unique_ptr<Journal> journal;
  if (!options.journal.empty()) {
    GS_ASSIGN(journal, Journal::Open(options.journal, JobKey(model, data, start, options), options.resume));
  }
  const auto solve_begin = std::chrono::steady_clock::now();
  // Windows first: they converge from far; the free run then sees what is slow, when it can be simulated at all.
  const auto solve_from = [&](const FitPoint* random, std::vector<double>* values, FitProblem** last,
                              std::vector<std::unique_ptr<FitProblem>>* problems) -> SolveResult {
    TuneOptions stage = options;
    stage.objective = options.objective == Objective::kFreeRun ? Objective::kFreeRun : Objective::kWindows;
    problems->push_back(
        std::make_unique<FitProblem>(model, data.train, MakeFitOptions(stage, free, options.time_step_s), start, pool));
    FitProblem* problem = problems->back().get();
    problem->set_journal(journal.get());
    FitPoint point = random ? *random : problem->Start();
    SolveResult found = Solve(*problem, point, options.solve);
    if (options.objective != Objective::kBoth && (options.huber > 0 || options.fit_states) &&
        found.termination != Termination::kNotSimulated) {
      if (options.fit_states) problem->WeighStates(found.point);
      problem->UpdateRobustScale(found.point);
      found = Solve(*problem, found.point, options.solve);
    }
    if (options.objective == Objective::kBoth && found.termination != Termination::kNotSimulated) {
      problems->push_back(std::make_unique<FitProblem>(
          model, data.train, MakeFitOptions(options, free, options.time_step_s), start, pool));
      FitProblem* both = problems->back().get();
      both->set_journal(journal.get());
      FitPoint joint = both->Start();
      joint.y = found.point.y;
      // Windows come log by log, each log's free run last: their states are found again from the log.
      if (std::isfinite(both->Cost(joint))) {
        if (options.fit_states) both->WeighStates(joint);
        joint = SolveStates(*both, joint, 3);
        both->UpdateRobustScale(joint);
        const SolveResult polished = Solve(*both, joint, options.solve);
        if (polished.termination != Termination::kNotSimulated && std::isfinite(polished.cost)) {
          found = polished;
          problem = both;
        }
      }
    }
    *values = problem->Values(found.point);
    *last = problem;
    return found;
  };
  std::mt19937_64 random(options.solve.seed + 1);
  std::vector<std::unique_ptr<FitProblem>> problems, best_problems;
  FitProblem* best_problem = nullptr;
  SolveResult best;
  for (int s = 0; s < std::max(1, options.starts); ++s) {
    if (s > 0 && options.solve.deadline && std::chrono::steady_clock::now() >= *options.solve.deadline) break;
    std::vector<double> values;
    FitProblem* problem = nullptr;
    FitPoint from;
    if (s > 0) {
      TuneOptions stage = options;
      stage.objective = options.objective == Objective::kFreeRun ? Objective::kFreeRun : Objective::kWindows;
      FitProblem probe(model, data.train, MakeFitOptions(stage, free, options.time_step_s), start, pool);
      from = RandomStart(probe, random);
    }
    SolveResult found = solve_from(s > 0 ? &from : nullptr, &values, &problem, &problems);
    for (const auto& p : problems) summary.evaluations += p->evaluations(), summary.replays += p->replays();
    summary.start_costs.push_back(found.cost);
    if (!best_problem || (std::isfinite(found.cost) && found.cost < best.cost)) {
      best = std::move(found);
      best_problem = problem;
      best_problems = std::move(problems);
      summary.values = values;
    }
    problems.clear();
  }
  if (best.termination == Termination::kNotSimulated) {
    return Error{.what = "the model cannot be simulated at the start of the fit",
                 .where = model.experiment().path,
                 .cure = "check the parameters' nominal values, or use shorter windows (--window)"};
  }
  summary.solve_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - solve_begin).count();
  summary.termination = best.termination;
  for (const double cost : summary.start_costs)
    summary.starts_agree = summary.starts_agree && cost <= best.cost * (1 + kAgree);
  summary.shift_s = best_problem->Shift(best.point);
  Uncertainty uncertainty = EstimateUncertainty(*best_problem, best.point, model, options.solve.fine_step);
  summary.tuned = std::move(uncertainty.tuned);
  summary.flat = std::move(uncertainty.flat);
  summary.correlated = std::move(uncertainty.correlated);
  const ReplayMode mode = model.experiment().replay.mode;
  summary.error_nominal = ReplayError(Evaluate(model, data.held_out, model.Nominal(), 0, mode, options, pool));
  summary.train = Evaluate(model, data.train, summary.values, summary.shift_s, mode, options, pool);
  summary.held_out = Evaluate(model, data.held_out, summary.values, summary.shift_s, mode, options, pool);
  summary.error_train = ReplayError(summary.train);
  summary.error_held_out = ReplayError(summary.held_out);
  summary.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return summary;
}

}  // namespace gapscope
