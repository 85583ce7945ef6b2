// The methods that minimise a fit's cost, in one table. All see the problem with the windows' states eliminated.
// Another one is a file with a function of this form, and a row of the table in optimizers.cc.
#ifndef GAPSCOPE_FIT_OPTIMIZERS_H_
#define GAPSCOPE_FIT_OPTIMIZERS_H_

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "src/fit/objective.h"

namespace gapscope {

// When a search is to end with the best so far: at a time, or as soon as somebody asks.
struct Deadline {
  std::optional<std::chrono::steady_clock::time_point> time = {};
  const std::atomic<bool>* stop = nullptr;

  bool stopped() const { return stop && stop->load(); }
};
inline bool IsLate(const Deadline& deadline) {
  return deadline.stopped() || (deadline.time && std::chrono::steady_clock::now() >= *deadline.time);
}

struct Progress {
  double best = 0;  // cost
  std::size_t evaluations = 0;
  int iteration = 0;
};

// True ends the fit.
using GiveUp = std::function<bool(double cost, int iteration)>;

struct SolveOptions {
  std::string optimizer = "lm";  // a name of Optimizers()
  int max_iterations = 60;       // Jacobians of lm; others: see their files
  double tolerance = 1e-4;       // stop when a step lowers the cost by less than this share
  // Finite differences, in search coordinates: first coarse, once converged fine.
  double coarse_step = 0.05, fine_step = 0.01;
  // lm: of coarse differences. Quick ones do for windows of about a second; over a long free run their motion is
  // another.
  StepKind coarse_steps = StepKind::kOwn;
  double damping = 1e-2;  // lm: of the first step, relative to the diagonal
  // lm: central differences, whose columns of parameters that only act as a ratio are parallel.
  bool central = false;
  bool secant = true;  // lm: between two Jacobians, steps with secant updates of the last one
  GiveUp give_up;      // lm: asked before each Jacobian
  // lm: derivatives at the start, near enough for steps that are tried: the first iteration is made with them.
  std::shared_ptr<const Derivatives> inherited;
  Deadline deadline;
  unsigned long seed = 0;  // of what is random in a global method
  std::function<void(const Progress&)> progress;
};

// kBudget: the deadline; kInterrupted: it was asked to stop.
enum class Termination { kConverged, kIterations, kBudget, kStalled, kHopeless, kNotSimulated, kInterrupted };
std::string TerminationText(Termination termination);

struct SolveResult {
  FitPoint point;
  double cost = 0;
  Termination termination = Termination::kConverged;
  int iterations = 0;
  Work work;
  // lm: at the point, the last Jacobian kept up by secant updates; null where the fit began at its end.
  std::shared_ptr<const Derivatives> derivatives;
};

// What a method is given: the problem, the same as an objective (journaled where there is a journal), and the journal
// for a method that keeps its own state there.
struct SolveTask {
  FitProblem& problem;
  Objective& objective;
  Journal* journal = nullptr;
};

struct OptimizerRow {
  std::string name;  // "lm", "nlopt:slsqp"
  std::string doc;   // what it is, in half a line
  SolveResult (*solve)(const SolveTask& task, const FitPoint& start, const SolveOptions& options,
                       const OptimizerRow& row);
  int algorithm = 0;  // NLopt's number, where one function serves several rows
};
const std::vector<OptimizerRow>& Optimizers();
// By name; NLopt's also without their prefix. Null: no such.
const OptimizerRow* FindOptimizer(const std::string& name);
// All names that FindOptimizer knows, and a line for help that says what they are.
std::vector<std::string> OptimizerNames();
std::string OptimizerHelp();

SolveResult Solve(const SolveTask& task, const FitPoint& start, const SolveOptions& options);
// Without a journal.
SolveResult Solve(FitProblem& problem, const FitPoint& start, const SolveOptions& options);

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_OPTIMIZERS_H_
