#include "src/diagnose/candidate.h"

#include <algorithm>
#include <cmath>

#include "src/core/statistics.h"
#include "src/diagnose/policy.h"
#include "src/fit/inherit.h"
#include "src/fit/policy.h"

namespace gapscope {

namespace {

// Residuals of neighbouring samples say the same thing twice: the data count for this much less against what is known
// beforehand.
constexpr double kCorrelated = 10;

// Of residuals that cost so much, in units of the noise's.
double VarianceAt(const FitProblem& problem, double cost) {
  return 2 * cost / static_cast<double>(std::max<std::size_t>(1, problem.residuals()));
}

SolveResult Recorded(const Workbench& bench, const std::string& call, const FitPoint& start, double keep_below,
                     const std::function<SolveResult()>& solve) {
  return bench.journal ? bench.journal->Solve(call, start, keep_below, solve) : solve();
}

}  // namespace

std::string Candidate::Name() const {
  std::string name;
  for (const auto& use : effects) name += (name.empty() ? "" : " + ") + use.Text();
  return name.empty() ? "none" : name;
}

void ChooseWindows(const Model& model, std::size_t max_windows, Workbench* bench) {
  bench->max_windows = max_windows;
  bench->windows.reset();
  FitOptions options = bench->Options(model, true);
  options.max_windows = 0;
  const std::vector<LogWindow> all = TakenWindows(bench->data->train, options);
  bench->all_windows = all.size();
  bench->windows =
      std::make_shared<const std::vector<LogWindow>>(gapscope::ChooseWindows(bench->data->train, all, max_windows));
}

Workbench WithLogs(const Workbench& bench, const DataSplit& data, const Model& model) {
  Workbench other = bench;
  other.data = &data;
  ChooseWindows(model, bench.max_windows, &other);
  return other;
}

Workbench ForSizes(const Workbench& bench, const Candidate& candidate) {
  const double half_seconds = kDiagnosePolicy.evidence.half_seconds * static_cast<double>(candidate.point.y.size()) /
                              static_cast<double>(bench.coupling->limb_count());
  const double windows = half_seconds * kFitPolicy.block_s / bench.window_s;
  Workbench wider = bench;
  if (!candidate.effects.empty() && windows > static_cast<double>(bench.windows->size()))
    ChooseWindows(*candidate.model, static_cast<std::size_t>(std::ceil(windows)), &wider);
  return wider;
}

bool Has(const std::vector<EffectUse>& set, const EffectUse& use) {
  return std::find(set.begin(), set.end(), use) != set.end();
}

FitOptions Workbench::Options(const Model& model, bool train) const {
  FitOptions options{.window_s = window_s,
                     .max_windows = train ? max_windows : (max_windows + 1) / 2,
                     .choice = train ? WindowChoice::kTelling : WindowChoice::kEven,
                     .windows = train ? windows : nullptr,
                     .coupling = train ? coupling : nullptr,
                     .time_step_s = time_step_s,
                     .shift_range_s = sample_s,
                     .weights = weights,
                     .prior_share = kFitPolicy.known_share,
                     .prior_offset_rad = kFitPolicy.known_offset_rad,
                     .prior_scale = kCorrelated,
                     .linear_terms = true,
                     .bounds = *bounds,
                     .huber = 0};
  if (by_windows) options.fold = train ? Fold::kTrain : Fold::kHeldOut;
  // Two bodies on a stiff link ask for a finer step, and a first-order integrator for no coarser one than the MJCF's.
  if (!model.mirrored_joints().empty()) {
    const mjOption& own = model.compiled().opt;
    options.time_step_s = std::min(time_step_s / 2, own.integrator == mjINT_RK4 ? kInfinity : own.timestep);
  }
  if (train) options.free = FreeParameters(model);
  return options;
}

std::vector<int> Workbench::FreeParameters(const Model& model) const {
  std::vector<int> free = model.FreeParameters();
  std::erase_if(free, [&](int i) { return frozen.contains(model.parameters()[static_cast<std::size_t>(i)].name); });
  return free;
}

std::vector<double> Workbench::Nominal(const Model& model) const {
  std::vector<double> nominal = model.Nominal();
  for (const EffectUse& use : known) {
    for (const auto& p : PlacedParameters(use, *rig, scales))
      nominal[static_cast<std::size_t>(model.IndexOf(p.name))] = p.start;
  }
  for (const auto& [name, value] : values) nominal[static_cast<std::size_t>(model.IndexOf(name))] = value;
  return nominal;
}

double Workbench::PriorOf(const EffectUse& use) const {
  for (const std::string& name : {use.Text(), use.effect}) {
    if (const auto given = priors.find(name); given != priors.end()) return given->second;
  }
  return Statement{}.prior;
}

Result<Candidate> MakeCandidate(const Workbench& bench, const std::vector<EffectUse>& effects) {
  Candidate candidate{.effects = effects};
  std::vector<EffectUse> all = bench.known;
  all.insert(all.end(), effects.begin(), effects.end());
  GS_ASSIGN(candidate.model, Model::Build(bench.rig, all, bench.scales, bench.contacts));
  candidate.values = bench.Nominal(*candidate.model);
  candidate.problem = std::make_unique<FitProblem>(*candidate.model, bench.data->train,
                                                   bench.Options(*candidate.model, true), candidate.values, bench.pool);
  for (const auto& use : effects) {
    for (const auto& p : PlacedParameters(use, *bench.rig, bench.scales))
      candidate.parameters += p.role != ParameterRole::kShape;
  }
  return candidate;
}

double CostAt(const Workbench& bench, const Candidate& candidate, const FitPoint& point) {
  const auto evaluate = [&] { return candidate.problem->Evaluate(point, Keep::kCost); };
  const Evaluation there =
      bench.journal ? bench.journal->Evaluate("cost " + candidate.Name(), point, evaluate) : evaluate();
  *bench.work += there.work;
  return candidate.problem->CostOfAnyVariance(there.cost, point.y);
}

void SplitTrainCost(const Workbench& bench, Candidate* candidate) {
  FitProblem& problem = *candidate->problem;
  candidate->train_limbs = {{candidate->train_cost, 0.5 * static_cast<double>(problem.residuals())}};
  if (bench.coupling->limb_count() == 1 || !std::isfinite(candidate->train_cost)) return;
  const Evaluation there = problem.Evaluate(candidate->point, Keep::kResiduals);
  *bench.work += there.work;
  candidate->train_limbs = ScaledTo(candidate->train_cost, CostsByLimb(problem, there.residuals, *bench.coupling));
}

void FitCandidate(const Workbench& bench, Candidate* candidate, const FitPoint& start, const FitLimits& limits,
                  GiveUp give_up, const Candidate* from) {
  candidate->problem->CountKnown(VarianceAt(*candidate->problem, limits.least_known));
  const auto solve = [&] {
    SolveOptions options{.max_iterations = limits.iterations,
                         .tolerance = limits.tolerance,
                         .coarse_step = kCoarseStep,
                         .fine_step = kFineStep,
                         .coarse_steps = StepKind::kQuick,
                         .give_up = std::move(give_up),
                         .deadline = bench.deadline};
    Work inheriting;
    if (from && from->derivatives) {
      auto made = Inherit(*from->problem, *from->derivatives, *candidate->problem, start, kCoarseStep);
      inheriting = made.work;
      if (made.valid) options.inherited = std::make_shared<const Derivatives>(std::move(made));
    }
    SolveResult result = Solve(*candidate->problem, start, options);
    result.work += inheriting;
    result.cost = candidate->problem->CostOfAnyVariance(result.cost, result.point.y);
    return result;
  };
  // A fit that ends above the candidate's is not kept (Ledger), nor is its Jacobian.
  const SolveResult solved = Recorded(bench, "fit " + candidate->Name(), start, candidate->train_cost, solve);
  *bench.work += solved.work;
  candidate->scored = false;
  candidate->point = solved.point;
  candidate->derivatives = solved.derivatives;
  candidate->train_cost = solved.cost;
  candidate->converged = solved.termination == Termination::kConverged;
  candidate->values = candidate->problem->Values(solved.point);
  candidate->stamps = candidate->problem->Stamps(solved.point);
  SplitTrainCost(bench, candidate);
}

void PolishCandidate(const Workbench& bench, Candidate* candidate) {
  constexpr double kPriorLevel = 0.2;  // of the cost, in which the prior counts one half per squared standard deviation
  FitOptions fit = bench.Options(*candidate->model, true);
  fit.linear_terms = false;
  fit.logarithmic_effects = true;
  fit.prior_centre = bench.Nominal(*candidate->model);
  auto problem = std::make_unique<FitProblem>(*candidate->model, bench.data->train, fit, candidate->values, bench.pool);
  problem->CountKnown(VarianceAt(*candidate->problem, candidate->train_cost));
  const FitPoint start = CarryOver(*candidate->problem, candidate->point, *problem, candidate->values);
  const SolveOptions options{.max_iterations = 8,
                             .tolerance = kPriorLevel / std::max(candidate->train_cost, 1.0),
                             .coarse_step = 0.01,
                             .fine_step = 0.01,
                             .damping = 1e-8,
                             .central = true,
                             .secant = false,
                             .deadline = bench.deadline};
  const SolveResult solved = Recorded(bench, "polish " + candidate->Name(), start, -kInfinity,
                                      [&] { return Solve(*problem, start, options); });
  *bench.work += solved.work;
  if (!std::isfinite(solved.cost)) return;
  candidate->scored = false;
  candidate->problem = std::move(problem);
  candidate->derivatives.reset();
  candidate->point = solved.point;
  candidate->train_cost = candidate->problem->CostOfAnyVariance(solved.cost, solved.point.y);
  candidate->values = candidate->problem->Values(solved.point);
  candidate->stamps = candidate->problem->Stamps(solved.point);
  SplitTrainCost(bench, candidate);
}

namespace {

// The held-out logs with the candidate's parameters held: left are initial states and zero offsets.
std::unique_ptr<FitProblem> HeldOutProblem(const Workbench& bench, const Candidate& candidate, FitOptions options) {
  options.fit_shift = false;
  options.stamps = candidate.stamps;
  return std::make_unique<FitProblem>(*candidate.model, bench.data->held_out, options, candidate.values, bench.pool);
}

// That problem fitted, as `options` score it. Null where the candidate cannot be simulated there.
std::unique_ptr<FitProblem> OnHeldOut(const Workbench& bench, const Candidate& candidate, const FitOptions& options,
                                      FitPoint* point) {
  auto problem = HeldOutProblem(bench, candidate, options);
  *point = problem->Start();
  const auto solve = [&] {
    if (!std::isfinite(problem->Evaluate(*point, Keep::kCost).cost)) return SolveResult{.cost = kInfinity};
    return Solve(*problem, *point, {.max_iterations = 4, .tolerance = 1e-3, .coarse_step = 0.01, .fine_step = 0.01});
  };
  const SolveResult solved = Recorded(bench, "held out " + candidate.Name(), *point, -kInfinity, solve);
  if (!std::isfinite(solved.cost)) return nullptr;
  *bench.work += solved.work;
  *point = solved.point;
  return problem;
}

}  // namespace

void ScoreCandidate(const Workbench& bench, Candidate* candidate) {
  if (std::exchange(candidate->scored, true)) return;
  candidate->held_out.clear();
  candidate->held_out_cost = candidate->held_out_error = candidate->held_out_floors = kInfinity;
  candidate->held_out_limbs = {{kInfinity, 0}};
  FitPoint point;
  const auto problem = OnHeldOut(bench, *candidate, bench.Options(*candidate->model, false), &point);
  if (!problem) return;
  const Evaluation there = problem->Evaluate(point, Keep::kResiduals);
  candidate->held_out_cost = there.cost;
  candidate->held_out_limbs = ScaledTo(there.cost, CostsByLimb(*problem, there.residuals, *bench.coupling));
  const double rows = static_cast<double>(std::max<std::size_t>(1, problem->residuals()));
  candidate->held_out_floors = std::sqrt(2 * candidate->held_out_cost / rows);
  const std::vector<LogReplay> predicted = problem->Predict(point);
  candidate->held_out = ErrorsByBlock(predicted);
  candidate->held_out_error = ReplayError(predicted);
  candidate->held_out_point = std::move(point);
}

std::vector<LogReplay> PredictHeldOut(const Workbench& bench, const Candidate& candidate) {
  if (candidate.held_out.empty()) return {};
  return HeldOutProblem(bench, candidate, bench.Options(*candidate.model, false))->Predict(candidate.held_out_point);
}

FreeRuns RunFree(const Workbench& bench, const Candidate& candidate) {
  FitOptions options = bench.Options(*candidate.model, false);
  options.fold = Fold::kAll;
  options.max_windows = 0;
  // Of long logs some parts: all of them would say the same again.
  const EvidencePolicy& policy = kDiagnosePolicy.evidence;
  const bool is_long = std::any_of(bench.data->held_out.begin(), bench.data->held_out.end(), [&](const Recording& r) {
    return r.time_s.back() - r.time_s.front() > 2 * policy.free_run_s;
  });
  if (is_long) {
    options.window_s = policy.free_run_s;
    options.max_windows = policy.free_runs;
  } else {
    options.objective = ObjectiveKind::kFreeRun;
  }
  options.weights.clear();
  options.prior_offset_rad = 0;  // which is in the sensors' noises
  FitPoint point;
  const auto problem = OnHeldOut(bench, candidate, options, &point);
  FreeRuns result;
  if (!problem) return result;
  result.error = ReplayError(problem->Predict(point));
  std::vector<FitProblem::FittedStart> starts = problem->FittedStarts(point);
  for (std::size_t w = 0; w < starts.size(); ++w) {
    const FitWindow& window = problem->windows()[w];
    const Recording& log = problem->recordings()[window.log];
    FreeRun& run = result.runs.emplace_back();
    run.log = log.log_path;
    run.from_s = log.start_s + log.time_s[window.rows.begin];
    run.until_s = log.start_s + log.time_s[window.rows.end - 1];
    run.commands_late_s = problem->Stamps(point).commands_s;
    run.start = std::move(starts[w].state);
    for (std::size_t s = 0; s < log.measured.size(); ++s)
      run.offsets.emplace_back(log.measured[s].spec.signal, starts[w].offsets[s]);
  }
  return result;
}

double PlaceInRange(double value, double low, double high) {
  return low > 0 ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
}

OnBound BoundOf(double value, double low, double high) {
  constexpr double kEdge = 1e-3;  // of the range
  const double at = PlaceInRange(std::max(value, low), low, high);
  return at <= kEdge ? OnBound::kLow : at >= 1 - kEdge ? OnBound::kHigh : OnBound::kNo;
}

}  // namespace gapscope
