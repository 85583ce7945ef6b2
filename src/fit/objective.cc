#include "src/fit/objective.h"

namespace gapscope {

Evaluation JournaledObjective::Evaluate(const FitPoint& point, Keep keep) {
  const Hasher call = CallAt("evaluate", point);
  if (std::vector<double> record; journal_.Next(call, &record)) return UnpackEvaluation(record);
  Evaluation result = inner_.Evaluate(point, keep);
  journal_.Append(call, Pack(result));
  return result;
}

Linearization JournaledObjective::Linearize(const FitPoint& point, const DifferenceOptions& options) {
  const Hasher call = CallAt("linearize", point).Number(options.step).Number(static_cast<int>(options.columns));
  if (std::vector<double> record; journal_.Next(call, &record)) return UnpackLinearization(record);
  Linearization result = inner_.Linearize(point, options);
  journal_.Append(call, Pack(result));
  return result;
}

FitPoint SolveStates(const FitProblem& problem, Objective& objective, FitPoint point, int steps, Work* work) {
  if (point.states.empty() || point.states.front().size() == 0) return point;
  for (int i = 0; i < steps; ++i) {
    const Linearization at = objective.Linearize(point, {.columns = DifferenceOptions::Columns::kStates});
    *work += at.work;
    if (!at.valid) break;
    point = Move(problem, point, at, Eigen::VectorXd::Zero(point.y.size()));
  }
  return point;
}

}  // namespace gapscope
