// The optimisers on problems whose answer is known.
#include "src/fit/optimizers.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

// A free run of the cart, gain the only unknown: gain = sum(s (y - f)) / sum(s s), s the motion from rest at gain 1, f
// the free one from the log's start.
double CostOf(FitProblem& problem, const FitPoint& point) { return problem.Evaluate(point, Keep::kCost).cost; }

struct OneGain {
  std::vector<Recording> logs;
  double solution = 0;
};
OneGain MakeOneGain(const Rig& rig) {
  std::vector<double> command(301);
  for (std::size_t k = 0; k < command.size(); ++k) command[k] = std::sin(0.03 * static_cast<double>(k));
  std::vector<double> y = CartMotion(2.2, 0, 0, command);
  const std::vector<double> s = CartMotion(1, 0, 0, command);
  // What the model cannot explain; the start stays as it is, so that the fitted initial state does.
  for (std::size_t k = 20; k < y.size(); ++k) y[k] += 0.02 * std::sin(0.5 * static_cast<double>(k));
  OneGain one{.logs = {MakeRecording(rig, command, y, kCartStep_s)}};
  const InitialState start = InitialStateAt(*rig.model, one.logs[0], 0, rig.model->Nominal());
  const std::vector<double> free = CartMotion(0, start.qpos[0], start.qvel[0], command);
  double sy = 0, ss = 0;
  for (std::size_t k = 1; k < y.size(); ++k) sy += s[k] * (y[k] - free[k]), ss += s[k] * s[k];
  one.solution = sy / ss;
  return one;
}

FitOptions OnlyGain(const Rig& rig) {
  return {.free = {rig.Index("cart.gain")},
          .objective = ObjectiveKind::kFreeRun,
          .time_step_s = kCartStep_s,
          .fit_offsets = false,
          .fit_shift = false,
          .fit_states = false};
}

TEST(SolveTest, LinearProblemHasItsClosedForm) {
  const Rig rig = LoadCart();
  const OneGain one = MakeOneGain(rig);
  ThreadPool pool(1);
  FitProblem problem(*rig.model, one.logs, OnlyGain(rig), rig.model->Nominal(), pool);
  const SolveResult found = Solve(problem, problem.Start(), {.tolerance = 1e-12});
  EXPECT_EQ(found.termination, Termination::kConverged);
  EXPECT_NEAR(problem.Values(found.point)[0], one.solution, 1e-5 * one.solution);
}

TEST(SolveTest, EveryOptimizerReachesTheLeastSquaresCost) {
  const Rig rig = LoadCart();
  const OneGain one = MakeOneGain(rig);
  ThreadPool pool(2);
  double least = 0;
  for (const OptimizerRow& row : Optimizers()) {
    FitProblem problem(*rig.model, one.logs, OnlyGain(rig), rig.model->Nominal(), pool);
    SolveOptions options{.optimizer = row.name, .tolerance = 1e-8, .seed = 5};
    const SolveResult found = Solve(problem, problem.Start(), options);
    if (row.name == "lm") least = found.cost;
    EXPECT_NEAR(found.cost, least, 1e-3 * least) << row.name;
    EXPECT_GE(found.cost, least * (1 - 1e-6)) << row.name;
  }
}

TEST(SolveTest, BoundHoldsAndTheRestIsSolvedAgain) {
  // The gain's bound is below its solution: it ends on the bound, and the zero offset is the best one for that gain.
  const Rig rig = LoadCart(-10, 2.0);
  OneGain one = MakeOneGain(rig);
  for (double& y : one.logs[0].measured[0].values) y += 0.1;
  ThreadPool pool(1);
  FitOptions options = OnlyGain(rig);
  options.fit_offsets = true;
  FitProblem problem(*rig.model, one.logs, options, rig.model->Nominal(), pool);
  const SolveResult found = Solve(problem, problem.Start(), {.tolerance = 1e-12});
  EXPECT_EQ(problem.Values(found.point)[0], 2.0);
  const double at = problem.layout().Offset(found.point.y, 0, 0);
  for (const double aside : {-0.002, 0.002}) {
    FitPoint other = found.point;
    other.y[1] += aside;
    EXPECT_GT(CostOf(problem, other), found.cost) << aside << " beside offset " << at;
  }
  const Linearization final = Linearize(problem, found.point, {});
  EXPECT_LT(final.gradient[0], 0);  // it would go on
  EXPECT_NEAR(final.gradient[1], 0, 1e-4 * final.hessian(1, 1));
}

TEST(SolveTest, SpentBudgetGivesTheBestSoFar) {
  const Rig rig = LoadCart();
  const OneGain one = MakeOneGain(rig);
  ThreadPool pool(1);
  for (const char* optimizer : {"lm", "nlopt:slsqp", "nlopt:bobyqa", "nlopt:crs2"}) {
    FitProblem problem(*rig.model, one.logs, OnlyGain(rig), rig.model->Nominal(), pool);
    const double start = CostOf(problem, problem.Start());
    const SolveResult found = Solve(problem, problem.Start(),
                                    {.optimizer = optimizer, .deadline = {.time = std::chrono::steady_clock::now()}});
    EXPECT_EQ(found.termination, Termination::kBudget);
    EXPECT_LE(found.cost, start);
    EXPECT_EQ(CostOf(problem, found.point), found.cost);
  }
}

TEST(SolveTest, NothingToFitIsSolved) {
  const Rig rig = LoadCart();
  const OneGain one = MakeOneGain(rig);
  ThreadPool pool(1);
  FitOptions options = OnlyGain(rig);
  options.free.clear();
  FitProblem none(*rig.model, one.logs, options, rig.model->Nominal(), pool);
  EXPECT_EQ(Solve(none, none.Start(), {}).cost, CostOf(none, none.Start()));
  options.fit_states = true;
  FitProblem states(*rig.model, one.logs, options, rig.model->Nominal(), pool);
  EXPECT_LT(Solve(states, states.Start(), {}).cost, CostOf(states, states.Start()));
}

TEST(SolveTest, StartThatCannotBeSimulatedIsSaid) {
  const Rig rig = LoadCart(-1e30, 1e30);
  OneGain one = MakeOneGain(rig);
  ThreadPool pool(1);
  FitProblem problem(*rig.model, one.logs, OnlyGain(rig), rig.Values({{"cart.gain", 1e20}}), pool);
  EXPECT_EQ(Solve(problem, problem.Start(), {}).termination, Termination::kNotSimulated);
}

}  // namespace
}  // namespace gapscope::testing
