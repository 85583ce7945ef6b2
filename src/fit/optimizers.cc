#include "src/fit/optimizers.h"

#include <algorithm>
#include <nlopt.hpp>

#include "src/fit/lm.h"
#include "src/fit/nlopt.h"

namespace gapscope {

const std::vector<OptimizerRow>& Optimizers() {
  static const std::vector<OptimizerRow> rows = {
      {"lm", "Levenberg-Marquardt on the normal equations", SolveLm},
      {"nlopt:slsqp", "NLopt's sequential quadratic programming, by gradients", SolveWithNlopt, nlopt::LD_SLSQP},
      {"nlopt:lbfgs", "NLopt's limited-memory BFGS, by gradients", SolveWithNlopt, nlopt::LD_LBFGS},
      {"nlopt:mma", "NLopt's method of moving asymptotes, by gradients", SolveWithNlopt, nlopt::LD_MMA},
      {"nlopt:bobyqa", "NLopt's quadratic models without gradients", SolveWithNlopt, nlopt::LN_BOBYQA},
      {"nlopt:crs2", "NLopt's controlled random search, global", SearchWithNlopt, nlopt::GN_CRS2_LM},
      {"nlopt:isres", "NLopt's evolution strategy, global", SearchWithNlopt, nlopt::GN_ISRES},
      {"nlopt:direct", "NLopt's dividing rectangles, global", SearchWithNlopt, nlopt::GN_DIRECT_L},
      {"nlopt:mlsl", "NLopt's multi-level single linkage with slsqp, global", SearchWithNlopt, nlopt::G_MLSL_LDS},
  };
  return rows;
}

const OptimizerRow* FindOptimizer(const std::string& name) {
  const auto& rows = Optimizers();
  const auto found = std::find_if(rows.begin(), rows.end(),
                                  [&](const auto& row) { return row.name == name || row.name == "nlopt:" + name; });
  return found == rows.end() ? nullptr : &*found;
}

std::vector<std::string> OptimizerNames() {
  std::vector<std::string> names;
  for (const auto& row : Optimizers()) names.push_back(row.name);
  for (const auto& row : Optimizers()) {
    if (row.name.starts_with("nlopt:")) names.push_back(row.name.substr(6));
  }
  return names;
}

std::string OptimizerHelp() {
  std::string text;
  for (const auto& row : Optimizers()) text += (text.empty() ? "" : "; ") + row.name + ": " + row.doc;
  return text;
}

std::string TerminationText(Termination termination) {
  switch (termination) {
    case Termination::kConverged:
      return "converged";
    case Termination::kIterations:
      return "iteration limit";
    case Termination::kBudget:
      return "budget spent";
    case Termination::kInterrupted:
      return "interrupted";
    case Termination::kStalled:
      return "stalled at the start";
    case Termination::kHopeless:
      return "given up: far behind";
    case Termination::kNotSimulated:
      return "the start cannot be simulated";
  }
  return "";
}

SolveResult Solve(const SolveTask& task, const FitPoint& start, const SolveOptions& options) {
  const OptimizerRow* row = FindOptimizer(options.optimizer);
  GS_CHECK(row != nullptr);
  return row->solve(task, start, options, *row);
}

SolveResult Solve(FitProblem& problem, const FitPoint& start, const SolveOptions& options) {
  ProblemObjective objective(problem);
  return Solve({.problem = problem, .objective = objective}, start, options);
}

}  // namespace gapscope
