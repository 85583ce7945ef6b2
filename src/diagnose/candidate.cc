#include "src/diagnose/candidate.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gapscope {

namespace {

// Base parameters are known to about +-20 % and their bounds lie at nominal / 1.6 and nominal * 1.6.
constexpr double kPriorShare = 0.15;

}  // namespace

std::string Candidate::Name() const {
  std::string name;
  for (const auto& use : effects) name += (name.empty() ? "" : " + ") + use.Text();
  return name.empty() ? "none" : name;
}

FitOptions Workbench::Options(const Model& model, bool train) const {
  FitOptions options{.window_s = window_s, .max_windows = train ? max_windows : 0, .time_step_s = time_step_s, .weights = weights, .prior_share = kPriorShare, .huber = 0};
  if (by_windows) options.fold = train ? Fold::kTrain : Fold::kHeldOut;
  // Two bodies on a stiff link ask for a finer step.
  if (!model.mirrored_joints().empty()) options.time_step_s = time_step_s / 2;
  if (train) {
    for (std::size_t i = 0; i < model.parameters().size(); ++i) {
      const Parameter& p = model.parameters()[i];
      if (!p.frozen && p.low < p.high) options.free.push_back(static_cast<int>(i));
    }
  }
  return options;
}

Result<Candidate> MakeCandidate(const Workbench& bench, const std::vector<EffectUse>& effects) {
  Candidate candidate{.effects = effects};
  GS_ASSIGN(candidate.model, Model::Build(bench.experiment, effects, bench.scales));
  candidate.values = candidate.model->Nominal();
  candidate.problem = std::make_unique<FitProblem>(*candidate.model, bench.data.train, bench.Options(*candidate.model, true), candidate.values, bench.pool);
  for (const auto& use : effects) {
    GS_ASSIGN(const auto placed, candidate.model->EffectParameters(use, bench.scales));
    candidate.parameters += placed.size();
  }
  return candidate;
}

void FitCandidate(const Workbench& bench, Candidate* candidate, const FitPoint& start, int iterations, double tolerance) {
  const SolveOptions options{.max_iterations = iterations, .tolerance = tolerance, .coarse_step = 0.03, .fine_step = 0.01, .deadline = bench.deadline};
  const SolveResult solved = Solve(*candidate->problem, start, options);
  candidate->point = solved.point;
  candidate->train_cost = solved.cost;
  candidate->converged = solved.termination == Termination::kConverged;
  candidate->values = candidate->problem->Values(solved.point);
  candidate->shift_s = candidate->problem->Shift(solved.point);
}

void ScoreCandidate(const Workbench& bench, Candidate* candidate) {
  FitOptions options = bench.Options(*candidate->model, false);
  options.fit_shift = false;
  options.shift_s = candidate->shift_s;
  FitProblem problem(*candidate->model, bench.data.held_out, options, candidate->values, bench.pool);
  FitPoint point = problem.Start();
  candidate->held_out_cost = std::numeric_limits<double>::infinity();
  candidate->held_out_blocks.clear();
  if (!std::isfinite(problem.Cost(point))) return;
  point = Solve(problem, point, {.max_iterations = 4, .tolerance = 1e-3, .coarse_step = 0.01, .fine_step = 0.01}).point;
  candidate->held_out_blocks = problem.BlockCosts(point);
  if (candidate->held_out_blocks.empty()) return;
  candidate->held_out_cost = 0;
  for (const double cost : candidate->held_out_blocks) candidate->held_out_cost += cost;
}

PairedGain CompareCandidates(const Candidate& a, const Candidate& b) {
  PairedGain result;
  if (b.held_out_blocks.empty()) return {.gain = -1, .relative = -1, .z = -10};
  if (a.held_out_blocks.size() != b.held_out_blocks.size()) return {.gain = 1, .relative = 1, .z = 10};
  const double n = static_cast<double>(a.held_out_blocks.size());
  double square = 0;
  for (std::size_t i = 0; i < a.held_out_blocks.size(); ++i) result.gain += a.held_out_blocks[i] - b.held_out_blocks[i];
  for (std::size_t i = 0; i < a.held_out_blocks.size(); ++i) {
    const double d = a.held_out_blocks[i] - b.held_out_blocks[i] - result.gain / n;
    square += d * d;
  }
  const double deviation = std::sqrt(square * n / std::max(1.0, n - 1));
  result.relative = a.held_out_cost > 0 ? result.gain / a.held_out_cost : 0;
  result.z = deviation > 0 ? result.gain / deviation : result.gain > 0 ? 10 : result.gain < 0 ? -10 : 0;
  return result;
}

}  // namespace gapscope
