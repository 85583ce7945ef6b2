// Sums of Gram blocks against the normal equations and problems solved in full.
#include "src/fit/gram.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "src/core/dense.h"
#include "src/fit/blocks.h"
#include "src/fit/inherit.h"
#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

constexpr double kGramRounding = 1e-12;

double Wave(double t) { return 1.5 * std::sin(6 * t + 2 * t * t); }

// Two logs of a Qube whose arm has friction that the model lacks.
struct Bench {
  Rig truth = LoadRig("qube", {"coulomb_friction@arm"}), rig = LoadRig("qube");
  std::vector<Recording> logs;
  ThreadPool pool{2};
  Bench() {
    const auto values = truth.Values({{"coulomb_friction@arm.friction_n_m", 5e-4}, {"arm.damping", 2e-4}});
    for (unsigned long k = 0; k < 2; ++k) {
      const auto command = [k](double t) { return (k == 0 ? 1 : 0.7) * Wave(t); };
      logs.push_back(MakeLog(truth, values, command, 2.3, 0.004, 1e-3, k));
    }
  }
  FitOptions Options(const Rig& of) const {
    return {.free = {of.Index("motor.kt"), of.Index("arm.damping"), of.Index("pendulum.length")}, .time_step_s = 0.004};
  }
};

std::vector<Eigen::Index> First(Eigen::Index n) {
  std::vector<Eigen::Index> all(static_cast<std::size_t>(n));
  std::iota(all.begin(), all.end(), Eigen::Index{0});
  return all;
}

TEST(GramTest, SumsAreTheReducedNormalEquations) {
  Bench bench;
  for (const double huber : {0.0, 2.0}) {
    FitOptions options = bench.Options(bench.rig);
    options.huber = huber;
    FitProblem problem(*bench.rig.model, bench.logs, options, bench.rig.model->Nominal(), bench.pool);
    FitPoint point = problem.Start();
    for (auto& state : point.states) state.setConstant(1e-3);  // so that the states' priors have a slope
    problem.SetHuberThreshold(problem.Evaluate(point, Keep::kResiduals).residuals);
    const Linearization at = Linearize(problem, point, {});
    const GramSystem gram = MakeGram(problem, point, {}, {});
    ASSERT_TRUE(at.valid && gram.valid);
    const Eigen::MatrixXd& sum = gram.parts[0];
    const Eigen::Index n = gram.parameters;
    Eigen::MatrixXd hessian = sum.topLeftCorner(n, n);
    hessian.diagonal() += problem.prior().weight;
    const Eigen::VectorXd gradient = sum.col(n).head(n) + problem.prior().Gradient(point.y);
    EXPECT_LT((hessian - at.hessian).norm(), kGramRounding * at.hessian.norm()) << huber;
    EXPECT_LT((gradient - at.gradient).norm(), kGramRounding * at.gradient.norm()) << huber;
    // Half the squares left are the cost with the states at their best.
    if (huber == 0) {
      EXPECT_NEAR(0.5 * sum(n, n) + problem.prior().Cost(point.y), at.reduced_cost, 1e-10 * at.cost);
    }
  }
}

TEST(GramTest, PartOfOneLogIsWhatItIsAlone) {
  Bench bench;
  FitProblem both(*bench.rig.model, bench.logs, bench.Options(bench.rig), bench.rig.model->Nominal(), bench.pool);
  const std::vector<Recording> one = {bench.logs[0]};
  FitProblem alone(*bench.rig.model, one, bench.Options(bench.rig), bench.rig.model->Nominal(), bench.pool);
  const GramParts by_log{.count = 2, .of = [](std::size_t log, long, std::size_t) { return log; }};
  const GramSystem gram = MakeGram(both, both.Start(), {}, {}, by_log), wanted = MakeGram(alone, alone.Start(), {}, {});
  const Eigen::MatrixXd &sum = gram.parts[0], &expected = wanted.parts[0];
  const Eigen::Index r = gram.parameters, q = wanted.parameters;
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) EXPECT_NEAR(sum(i, j), expected(i, j), 1e-10 * std::abs(expected(i, i)));
    EXPECT_NEAR(sum(i, r), expected(i, q), 1e-10 * std::abs(expected(i, q)));
  }
  EXPECT_NEAR(sum(r, r), expected(q, q), 1e-10 * expected(q, q));
  EXPECT_EQ(gram.columns.back(), "residual");
  EXPECT_EQ(gram.columns[0], "motor.kt");
}

TEST(GramTest, PartsAddUpToTheWhole) {
  Bench bench;
  FitProblem problem(*bench.rig.model, bench.logs, bench.Options(bench.rig), bench.rig.model->Nominal(), bench.pool);
  FitPoint point = problem.Start();
  for (auto& state : point.states) state.setConstant(1e-3);
  const GramParts thirds{.count = 3, .of = [](std::size_t, long half_second, std::size_t) {
                           return static_cast<std::size_t>(half_second % 3);
                         }};
  const GramSystem whole = MakeGram(problem, point, {}, {}), parts = MakeGram(problem, point, {}, {}, thirds);
  ASSERT_EQ(parts.parts.size(), 3U);
  for (const auto& part : parts.parts) EXPECT_GT(part.norm(), 0.01 * whole.parts[0].norm());
  const Eigen::MatrixXd sum = parts.parts[0] + parts.parts[1] + parts.parts[2];
  EXPECT_LT((sum - whole.parts[0]).norm(), kGramRounding * whole.parts[0].norm());
  EXPECT_EQ(parts.half_seconds, whole.half_seconds);
}

// At the same point: a child's inherited columns are the parent's, and those that it lacks are differenced anew. Taken
// back out, the parent has its own again.
TEST(InheritTest, SharedColumnsAreTakenAndNewOnesMade) {
  Bench bench;
  FitProblem parent(*bench.rig.model, bench.logs, bench.Options(bench.rig), bench.rig.model->Nominal(), bench.pool);
  const FitPoint point = parent.Start();
  FitOptions options = bench.Options(bench.truth);
  options.free.push_back(bench.truth.Index("coulomb_friction@arm.friction_n_m"));
  FitProblem child(*bench.truth.model, bench.logs, options, bench.truth.model->Nominal(), bench.pool);
  constexpr double kStep = 0.01;
  const DifferenceOptions quick{.step = kStep, .steps = StepKind::kQuick};
  const Derivatives known = parent.Differentiate(point, quick), full = child.Differentiate(child.Start(), quick);
  const Derivatives inherited = Inherit(parent, known, child, child.Start(), kStep);
  ASSERT_TRUE(known.valid && full.valid && inherited.valid);
  // Without its friction the child is the parent: all columns are what differencing all of them gives.
  for (std::size_t w = 0; w < full.jacobians.size(); ++w) {
    const double size = full.jacobians[w].norm();
    EXPECT_LT((inherited.jacobians[w] - full.jacobians[w]).norm(), 1e-6 * size) << w;
    EXPECT_EQ(inherited.residuals[w], full.residuals[w]) << w;
  }
  EXPECT_LT(inherited.work.replays, full.work.replays / 2);
  const Derivatives back = Inherit(child, inherited, parent, point, kStep);
  for (std::size_t w = 0; w < known.jacobians.size(); ++w) EXPECT_EQ(back.jacobians[w], known.jacobians[w]) << w;
}

// A fit that begins with the Jacobian of the point nearby ends where the same fit without it ends, with less work.
TEST(InheritTest, FitEndsAtTheSamePlace) {
  Bench bench;
  FitProblem problem(*bench.rig.model, bench.logs, bench.Options(bench.rig), bench.rig.model->Nominal(), bench.pool);
  const SolveResult plain = Solve(problem, problem.Start(), {.tolerance = 1e-6});
  ASSERT_TRUE(plain.derivatives);
  FitPoint near = plain.point;
  near.y[0] += 0.05;
  const auto inherited = std::make_shared<const Derivatives>(Inherit(problem, *plain.derivatives, problem, near, 0.01));
  const SolveResult again = Solve(problem, near, {.tolerance = 1e-6, .inherited = inherited});
  EXPECT_NEAR(again.cost, plain.cost, 1e-4 * plain.cost);
  EXPECT_LT((again.point.y - plain.point.y).norm(), 1e-2);
}

// Against the dense problem: the column, y and every state in one least-squares system, with the states' priors.
TEST(GramTest, ExtraColumnDropsWhatTheDenseProblemDrops) {
  Bench bench;
  FitProblem parent(*bench.rig.model, bench.logs, bench.Options(bench.rig), bench.rig.model->Nominal(), bench.pool);
  const FitPoint point = Solve(parent, parent.Start(), {}).point;
  const auto values = bench.truth.Values({{"coulomb_friction@arm.friction_n_m", 3e-4}});
  FitProblem child(*bench.truth.model, bench.logs, bench.Options(bench.truth), values, bench.pool);
  const ExtraColumn friction{.name = "friction", .child = &child, .values = values};
  const GramSystem gram = MakeGram(parent, point, {&friction, 1}, {.step = 0.01});
  ASSERT_TRUE(gram.valid);
  const Eigen::MatrixXd& sum = gram.parts[0];
  const ColumnBounds bounds = BoundsAt(parent, point, gram, 2);
  const Eigen::Index n = gram.parameters;
  const BoundedSolution with = SolveBounded(sum, First(n + 1), bounds);
  ASSERT_TRUE(with.at_bound.empty());
  // Rows: all residuals, then the priors of states and of y.
  const Derivatives at = parent.Differentiate(point, {.step = 0.01});
  const Residuals moved = child.Evaluate(CarryOver(parent, point, child, values), Keep::kResiduals).residuals;
  Eigen::Index rows = n, states = 0;
  for (std::size_t w = 0; w < moved.size(); ++w) rows += moved[w].size() + point.states[w].size();
  for (const auto& state : point.states) states += state.size();
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(rows, n + 1 + states);
  Eigen::VectorXd b(rows);
  Eigen::Index row = 0, column = n + 1;
  for (std::size_t w = 0; w < moved.size(); ++w) {
    const Eigen::Index k = moved[w].size(), m = point.states[w].size();
    a.block(row, 0, k, n) = at.jacobians[w].leftCols(n);
    a.block(row, n, k, 1) = moved[w] - at.residuals[w];
    a.block(row, column, k, m) = at.jacobians[w].rightCols(m);
    b.segment(row, k) = at.residuals[w];
    a.block(row + k, column, m, m) = parent.windows()[w].prior.asDiagonal();
    b.segment(row + k, m) = parent.windows()[w].prior.cwiseProduct(point.states[w]);
    row += k + m, column += m;
  }
  const Eigen::VectorXd weight = bounds.prior_weight.head(n).cwiseSqrt();
  a.block(row, 0, n, n) = weight.asDiagonal();
  b.segment(row, n) = weight.cwiseProduct(bounds.prior_gone.head(n));
  const Eigen::VectorXd x = SolveLu(a.transpose() * a, -a.transpose() * b);
  EXPECT_NEAR(with.values[n], x[n], 1e-5 * std::abs(x[n]));
  EXPECT_NEAR(with.cost, 0.5 * (a * x + b).squaredNorm(), 1e-6 * with.cost);
}

// A torque that is injected changes the motion as the same torque in the model does: a bias is its sine at a right
// angle.
TEST(GramTest, ProbeOfAConstantIsABias) {
  Bench bench;
  const Rig with = LoadRig("qube", {"torque_bias@arm"});
  FitProblem parent(*bench.rig.model, bench.logs, bench.Options(bench.rig), bench.rig.model->Nominal(), bench.pool);
  FitProblem child(*with.model, bench.logs, bench.Options(bench.rig), with.model->Nominal(), bench.pool);
  constexpr double kBias_n_m = 2e-4;
  const int joint = mj_name2id(&bench.rig.model->compiled(), mjOBJ_JOINT, "arm");
  ASSERT_GE(joint, 0);
  const Residuals plain = parent.Evaluate(parent.Start(), Keep::kResiduals).residuals;
  parent.SetProbes({{.joint = joint, .amplitude_n_m = kBias_n_m, .phase_rad = std::numbers::pi / 2}});
  const Residuals probed = parent.Evaluate(parent.Start(), Keep::kResiduals).residuals;
  FitProblem biased(*with.model, bench.logs, bench.Options(bench.rig),
                    with.Values({{"torque_bias@arm.torque_n_m", kBias_n_m}}), bench.pool);
  const Residuals wanted = biased.Evaluate(biased.Start(), Keep::kResiduals).residuals;
  for (std::size_t w = 0; w < wanted.size(); ++w) {
    EXPECT_NEAR((probed[w] - wanted[w]).norm(), 0, 1e-3 * (wanted[w] - plain[w]).norm()) << w;
  }
}

TEST(GramTest, BoundedStepOfALinearProblemIsItsSolution) {
  const Rig rig = LoadCart(-10, 2.0);
  std::vector<double> command(501);
  for (std::size_t k = 0; k < command.size(); ++k) command[k] = std::sin(0.03 * static_cast<double>(k));
  const std::vector<Recording> logs = {MakeRecording(rig, command, CartMotion(2.6, 0.1, 0, command), kCartStep_s)};
  ThreadPool pool(1);
  const FitOptions options{
      .free = {rig.Index("cart.gain")}, .window_s = 0.5, .time_step_s = kCartStep_s, .fit_shift = false};
  FitProblem problem(*rig.model, logs, options, rig.model->Nominal(), pool);
  const FitPoint start = problem.Start();
  const GramSystem gram = MakeGram(problem, start, {}, {});
  const Eigen::MatrixXd& sum = gram.parts[0];
  const BoundedSolution solution = SolveBounded(sum, First(gram.parameters), BoundsAt(problem, start, gram, 1));
  // The gain's bound is below its solution; the zero offset is the best one for that.
  ASSERT_EQ(solution.at_bound, std::vector<Eigen::Index>{0});
  const SolveResult solved = Solve(problem, start, {.tolerance = 1e-12});
  EXPECT_NEAR(start.y[0] + solution.values[0], solved.point.y[0], 1e-12);
  EXPECT_NEAR(start.y[1] + solution.values[1], solved.point.y[1], 1e-5);
  EXPECT_NEAR(solution.cost, solved.cost, 1e-6 * problem.Evaluate(start, Keep::kCost).cost);
}

// Against every choice of bounds, solved one by one.
TEST(SolveBoundedTest, IsTheBestOfAllActiveSets) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 200; ++trial) {
    constexpr Eigen::Index k = 4;
    const Eigen::MatrixXd rows = Eigen::MatrixXd::NullaryExpr(9, k + 1, [&] { return normal(random); });
    const Eigen::MatrixXd sum = rows.transpose() * rows;
    const ColumnBounds bounds{.low = Eigen::VectorXd::Constant(k, -0.2),
                              .high = Eigen::VectorXd::Constant(k, 0.3),
                              .prior_weight = Eigen::VectorXd::Constant(k, 0.5),
                              .prior_gone = Eigen::VectorXd::Constant(k, 0.1)};
    const auto cost = [&](const Eigen::VectorXd& c) {
      return 0.5 * (rows.leftCols(k) * c + rows.col(k)).squaredNorm() + 0.25 * (c + bounds.prior_gone).squaredNorm();
    };
    double least = 1e300;
    for (int code = 0; code < 81; ++code) {
      Eigen::MatrixXd h = sum.topLeftCorner(k, k) + 0.5 * Eigen::MatrixXd::Identity(k, k);
      Eigen::VectorXd right = -(sum.col(k).head(k) + 0.5 * bounds.prior_gone);
      for (int i = 0, rest = code; i < k; ++i, rest /= 3) {
        if (rest % 3 == 0) continue;
        h.row(i).setZero();
        h(i, i) = 1;
        right[i] = rest % 3 == 1 ? bounds.low[i] : bounds.high[i];
      }
      const Eigen::VectorXd c = SolveLu(h, right);
      const bool inside = (c - bounds.low).minCoeff() > -1e-12 && (bounds.high - c).minCoeff() > -1e-12;
      if (inside) least = std::min(least, cost(c));
    }
    const BoundedSolution found = SolveBounded(sum, First(k), bounds);
    EXPECT_NEAR(found.cost, least, 1e-9 * least) << trial;
    EXPECT_NEAR(cost(found.values), found.cost, 1e-9 * least) << trial;
  }
}

TEST(BlocksTest, CostsOfBlocksAddUpAndMasksLeaveOut) {
  Bench bench;
  FitProblem problem(*bench.rig.model, bench.logs, bench.Options(bench.rig), bench.rig.model->Nominal(), bench.pool);
  const FitPoint point = problem.Start();  // where no state or parameter is pulled
  const Evaluation all = problem.Evaluate(point, Keep::kResiduals);
  const std::vector<BlockCost> blocks = CostsByBlock(problem, all.residuals);
  double sum = 0;
  std::size_t residuals = 0;
  for (const BlockCost& block : blocks) sum += block.cost, residuals += block.residuals;
  EXPECT_NEAR(sum, all.cost, 1e-10 * all.cost);
  EXPECT_EQ(residuals, problem.residuals());
  EXPECT_EQ(blocks.size(), 10u);  // five half seconds of each log: 2.3 s
  WindowMask mask(problem.windows().size(), 0);
  for (std::size_t w = 0; w < mask.size(); ++w) mask[w] = problem.windows()[w].log == 1;
  const Evaluation masked = problem.Evaluate(point, Keep::kResiduals, mask);
  EXPECT_EQ(masked.log_costs[0], 0);
  EXPECT_EQ(masked.log_costs[1], all.log_costs[1]);
  for (const BlockCost& block : CostsByBlock(problem, masked.residuals)) EXPECT_EQ(block.log, 1u);
  EXPECT_LT(masked.work.steps, all.work.steps);
}

TEST(WorkTest, StepsOfTheSimulatorAreCounted) {
  const Rig rig = LoadCart();
  const std::vector<double> command(401, 1.0);
  const std::vector<Recording> logs = {MakeRecording(rig, command, CartMotion(1, 0, 0, command), kCartStep_s)};
  for (const int jobs : {1, 3}) {
    ThreadPool pool(jobs);
    const FitOptions options{.free = {rig.Index("cart.gain")},
                             .objective = ObjectiveKind::kFreeRun,
                             .time_step_s = kCartStep_s,
                             .fit_offsets = false,
                             .fit_shift = false};
    FitProblem problem(*rig.model, logs, options, rig.model->Nominal(), pool);
    EXPECT_EQ(problem.Evaluate(problem.Start(), Keep::kCost).work.steps, 400u);
    // The point itself, one parameter, two numbers of the initial state.
    const Derivatives at = problem.Differentiate(problem.Start(), {});
    EXPECT_EQ(at.work.replays, 4u);
    EXPECT_EQ(at.work.steps, 1600u);
  }
}

}  // namespace
}  // namespace gapscope::testing
