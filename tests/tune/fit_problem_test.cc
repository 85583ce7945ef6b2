// The least-squares problem against closed forms: a cart on a spring is linear in everything that is fitted.
#include "src/tune/fit_problem.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

constexpr double kRounding = 1e-9;

// A log of the cart: gain 1.2, starting off the spring's rest, its zero 0.05 m off, a little noise.
Recording CartLog(const Rig& rig, std::size_t rows, double noise, unsigned long seed = 3) {
  std::vector<double> command(rows);
  for (std::size_t k = 0; k < rows; ++k) command[k] = std::sin(0.02 * static_cast<double>(k)) + (k / 100 % 2 == 0 ? 0.5 : -0.5);
  std::vector<double> q = CartMotion(1.2, 0.1, -0.3, command);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, noise);
  for (double& x : q) x += 0.05 + (noise > 0 ? normal(random) : 0);
  return MakeRecording(rig, std::move(command), std::move(q), kCartStep_s);
}

FitOptions CartOptions(const Rig& rig, Objective objective) {
  return {.free = {rig.Index("cart.gain")}, .objective = objective, .window_s = 0.5, .lead_in_s = 0.02, .time_step_s = kCartStep_s, .fit_shift = false};
}

double Deviation(const std::vector<double>& y) {
  double mean = 0, square = 0;
  for (const double x : y) mean += x / static_cast<double>(y.size());
  for (const double x : y) square += (x - mean) * (x - mean);
  return std::sqrt(square / static_cast<double>(y.size()));
}

// All residuals of the windows as one dense linear problem in (gain, offset, two states per window), by unit responses of the test's integrator.
struct Dense {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residual;  // at zero states and offset, the nominal gain
};
Dense DenseProblem(const Rig& rig, const Recording& recording, double lead_in_s) {
  const auto windows = MakeWindows(recording, ReplayMode::kWindows, 0.5);
  const auto& y = recording.measured.front().values;
  const double weight = 1 / Deviation(y), gain = rig.model->Nominal()[0];
  const double scale = std::max(1.5, 0.05 * 20);  // of the gain's coordinate
  const double prior = std::sqrt(5.0) * weight;
  std::vector<std::vector<double>> rows;
  std::vector<double> residual;
  const std::size_t columns = 2 + 2 * windows.size();
  for (std::size_t w = 0; w < windows.size(); ++w) {
    const Window window = windows[w];
    const std::vector<double> u(recording.commands[0].values.begin() + static_cast<std::ptrdiff_t>(window.begin),
                                recording.commands[0].values.begin() + static_cast<std::ptrdiff_t>(window.end));
    const std::vector<double> zero(u.size(), 0.0);
    const InitialState start = InitialStateAt(*rig.model, recording, window.begin, rig.model->Nominal());
    const auto base = CartMotion(gain, start.qpos[0], start.qvel[0], u), by_gain = CartMotion(1, 0, 0, u);
    const auto by_q = CartMotion(0, 1, 0, zero), by_v = CartMotion(0, 0, 1, zero);
    std::size_t first = 1;
    while (recording.time_s[window.begin + first] - recording.time_s[window.begin] < lead_in_s) ++first;
    for (std::size_t r = first; r < window.rows(); ++r) {
      std::vector<double> row(columns, 0.0);
      row[0] = weight * scale * by_gain[r];
      row[1] = weight * (1 - by_q[r]) / weight;  // in standard deviations; it moves the start the other way
      row[2 + 2 * w] = weight * by_q[r];
      row[3 + 2 * w] = weight * by_v[r];
      rows.push_back(row);
      residual.push_back(weight * (base[r] - y[window.begin + r]));
    }
    for (int j = 0; j < 2; ++j) {
      std::vector<double> row(columns, 0.0);
      row[2 + 2 * w + static_cast<std::size_t>(j)] = prior * (j == 0 ? 1 : kSpeedPrior_s);
      rows.push_back(row);
      residual.push_back(0);
    }
  }
  Dense dense{.jacobian = Eigen::MatrixXd(rows.size(), columns), .residual = Eigen::Map<Eigen::VectorXd>(residual.data(), static_cast<Eigen::Index>(residual.size()))};
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (std::size_t c = 0; c < columns; ++c) dense.jacobian(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = rows[r][c];
  }
  return dense;
}

TEST(FitProblemTest, CostIsHalfTheSumOfSquares) {
  const Rig rig = LoadCart();
  const std::vector<Recording> logs = {CartLog(rig, 501, 0.01)};
  ThreadPool pool(1);
  FitProblem problem(*rig.model, logs, CartOptions(rig, Objective::kWindows), rig.model->Nominal(), pool);
  const Dense dense = DenseProblem(rig, logs[0], 0.02);
  EXPECT_NEAR(problem.Cost(problem.Start()), 0.5 * dense.residual.squaredNorm(), kRounding * dense.residual.squaredNorm());
}

TEST(FitProblemTest, EliminatedStatesGiveTheFullProblemsNormalEquations) {
  const Rig rig = LoadCart();
  const std::vector<Recording> logs = {CartLog(rig, 501, 0.01)};
  ThreadPool pool(1);
  FitProblem problem(*rig.model, logs, CartOptions(rig, Objective::kWindows), rig.model->Nominal(), pool);
  const Linearization at = problem.Linearize(problem.Start(), 0.05);
  ASSERT_TRUE(at.valid);
  const Dense dense = DenseProblem(rig, logs[0], 0.02);
  const Eigen::MatrixXd full = dense.jacobian.transpose() * dense.jacobian;
  const Eigen::VectorXd slope = dense.jacobian.transpose() * dense.residual;
  const Eigen::Index m = full.rows() - 2;
  const Eigen::MatrixXd inner = full.bottomRightCorner(m, m).inverse();
  const Eigen::MatrixXd reduced = full.topLeftCorner(2, 2) - full.topRightCorner(2, m) * inner * full.bottomLeftCorner(m, 2);
  const Eigen::VectorXd gradient = slope.head(2) - full.topRightCorner(2, m) * inner * slope.tail(m);
  // The anchor adds 1e-8 of the residuals' count over the squared range.
  EXPECT_LT((at.hessian - reduced).norm(), 1e-6 * reduced.norm());
  EXPECT_LT((at.gradient - gradient).norm(), 1e-6 * gradient.norm());
  // One full step lands on the solution of the whole problem: its cost is that of the dense solution.
  const Eigen::VectorXd solution = full.ldlt().solve(-slope);
  const FitPoint moved = problem.Move(problem.Start(), at, at.hessian.ldlt().solve(-at.gradient));
  EXPECT_LT((moved.y - problem.Start().y - solution.head(2)).norm(), 1e-4 * solution.head(2).norm());
  for (std::size_t w = 0; w < problem.windows(); ++w) {
    EXPECT_LT((moved.states[w] - solution.segment<2>(2 + 2 * static_cast<Eigen::Index>(w))).norm(), 1e-4);
  }
  EXPECT_NEAR(problem.Cost(moved), 0.5 * (dense.residual + dense.jacobian * solution).squaredNorm(), 1e-6 * problem.Cost(problem.Start()));
}

TEST(FitProblemTest, GradientIsThatOfTheReducedCost) {
  // The Qube is not linear: the reduced cost is found by solving the states at every point.
  const Rig rig = LoadRig("qube");
  const auto truth = rig.Values({{"arm.damping", 3e-4}, {"motor.kt", 0.038}});
  const auto command = [](double t) { return 1.5 * std::sin(6 * t + 2 * t * t); };
  const std::vector<Recording> logs = {MakeLog(rig, truth, command, 2, 0.004, 2e-3, 1)};
  ThreadPool pool(2);
  FitProblem problem(*rig.model, logs, {.free = {rig.Index("motor.kt"), rig.Index("arm.damping")}, .time_step_s = 0.004, .fit_offsets = false}, rig.model->Nominal(), pool);
  FitPoint point = SolveStates(problem, problem.Start(), 6);
  const Linearization at = problem.Linearize(point, 1e-3);
  for (Eigen::Index i = 0; i < point.y.size(); ++i) {
    const double h = i + 1 < point.y.size() ? 2e-3 : 0.1;  // the shift is linear between samples
    double cost[2];
    for (int side = 0; side < 2; ++side) {
      FitPoint other = point;
      other.y[i] += side == 0 ? -h : h;
      cost[side] = problem.Cost(SolveStates(problem, other, 6));
    }
    EXPECT_NEAR(at.gradient[i], (cost[1] - cost[0]) / (2 * h), 0.02 * at.gradient.norm()) << i;
  }
}

TEST(FitProblemTest, HuberGrowsLinearlyBeyondTheThreshold) {
  const Rig rig = LoadCart();
  Recording log = CartLog(rig, 501, 0.01);
  ThreadPool pool(1);
  FitOptions options = CartOptions(rig, Objective::kFreeRun);
  options.huber = 4;
  options.fit_offsets = options.fit_states = false;
  const auto cost_with_outlier = [&](double outlier, bool robust) {
    std::vector<Recording> logs = {log};
    logs[0].measured[0].values[250] += outlier;
    options.weights = {1.0};
    FitProblem problem(*rig.model, logs, options, rig.Values({{"cart.gain", 1.2}}), pool);
    if (robust) problem.UpdateRobustScale(problem.Start());
    return problem.Cost(problem.Start());
  };
  // Far out: quadratic without, linear with.
  const double plain[] = {cost_with_outlier(10, false), cost_with_outlier(20, false)}, robust[] = {cost_with_outlier(10, true), cost_with_outlier(20, true), cost_with_outlier(30, true)};
  EXPECT_GT(plain[1] - plain[0], 140);
  EXPECT_NEAR(robust[2] - robust[1], robust[1] - robust[0], 1e-6);
  EXPECT_LT(robust[1] - robust[0], 0.1 * (plain[1] - plain[0]));
}

TEST(FitProblemTest, MissingSamplesAreLeftOut) {
  const Rig rig = LoadCart();
  Recording log = CartLog(rig, 501, 0.0);
  for (std::size_t k = 100; k < 150; ++k) log.measured[0].values[k] = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Recording> logs = {log};
  ThreadPool pool(1);
  FitOptions options = CartOptions(rig, Objective::kFreeRun);
  FitProblem problem(*rig.model, logs, options, rig.model->Nominal(), pool);
  const SolveResult found = Solve(problem, problem.Start(), {.tolerance = 1e-10});
  EXPECT_NEAR(problem.Values(found.point)[0], 1.2, 1e-3);
}

// On a linear problem a secant step leaves a Jacobian that explains the step, and normal equations with the cost of the new point.
TEST(FitProblemTest, SecantUpdateExplainsItsStep) {
  const Rig rig = LoadRig("qube");
  const auto command = [](double t) { return 1.5 * std::sin(6 * t + 2 * t * t); };
  const std::vector<Recording> logs = {MakeLog(rig, rig.Values({{"arm.damping", 3e-4}}), command, 2, 0.004, 2e-3, 1)};
  ThreadPool pool(1);
  FitProblem problem(*rig.model, logs, {.free = {rig.Index("motor.kt"), rig.Index("arm.damping")}, .time_step_s = 0.004}, rig.model->Nominal(), pool);
  const FitPoint from = problem.Start();
  Snapshot snapshot = problem.Differentiate(from, 0.01, FitProblem::Columns::kAll);
  const std::vector<Eigen::VectorXd> before = snapshot.residuals;
  FitPoint to = from;
  to.y[0] += 0.05;
  to.y[1] -= 0.3;
  to.states[1][0] += 0.01;
  std::vector<Eigen::VectorXd> after;
  const double cost = problem.CostAndResiduals(to, &after);
  const std::vector<Eigen::VectorXd> kept = after;
  problem.UpdateSecant(snapshot, from, to, std::move(after));
  for (std::size_t w = 0; w < problem.windows(); ++w) {
    Eigen::VectorXd moved(snapshot.jacobians[w].cols());
    moved << to.y - from.y, to.states[w] - from.states[w];
    EXPECT_LT((snapshot.jacobians[w] * moved - (kept[w] - before[w])).norm(), 1e-9 * kept[w].norm()) << w;
  }
  EXPECT_NEAR(problem.Reduce(to, snapshot, false).cost, cost, 1e-12 * cost);
}

// A command later than one sample drives the nuisance shift onto its bound: the score test must still see what a delay would explain.
TEST(TestColumnTest, SeesADelayBeyondTheNuisanceShift) {
  const Rig truth = LoadRig("flexlink", {"command_delay@motor"}), rig = LoadRig("flexlink");
  const auto command = [](double t) { return 0.4 * std::sin(5 * t + 3 * t * t); };
  const std::vector<Recording> logs = {MakeLog(truth, truth.Values({{"command_delay@motor.delay_s", 0.012}}), command, 4, 0.004, 2e-4, 1)};
  ThreadPool pool(2);
  const FitOptions options{.free = {rig.Index("motor.torque_per_ampere"), rig.Index("hub.inertia"), rig.Index("link.stiffness")}, .time_step_s = 0.004};
  FitProblem parent(*rig.model, logs, options, rig.model->Nominal(), pool);
  const FitPoint point = Solve(parent, parent.Start(), {.tolerance = 1e-5}).point;
  EXPECT_NEAR(parent.Shift(point), 0.004, 1e-9);
  const Snapshot base = parent.Capture(point, 0.01);
  ASSERT_TRUE(base.valid);
  FitOptions of_child = options;
  of_child.free = {truth.Index("motor.torque_per_ampere"), truth.Index("hub.inertia"), truth.Index("link.stiffness"), truth.Index("command_delay@motor.delay_s")};
  FitProblem child(*truth.model, logs, of_child, truth.model->Nominal(), pool);
  const auto drop = [&](double delay_s) {
    return child.TestColumn(child.FromParent(parent, point, truth.Values({{"command_delay@motor.delay_s", delay_s}}), {}), parent, point, base).drop / base.cost;
  };
  EXPECT_GT(drop(0.008), 0.3);
  EXPECT_LT(drop(0.001), 0.01);  // earlier than the shift already is
}

}  // namespace
}  // namespace gapscope::testing
