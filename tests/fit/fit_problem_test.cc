// The least-squares problem against closed forms: a cart on a spring is linear in everything that is fitted.
#include "src/fit/fit_problem.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numeric>
#include <random>

#include "src/fit/gram.h"
#include "src/fit/optimizers.h"
#include "src/fit/policy.h"
#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

constexpr double kRounding = 1e-9;

// A log of the cart: gain 1.2, starting off the spring's rest, its zero 0.05 m off, a little noise.
Recording CartLog(const Rig& rig, std::size_t rows, double noise, unsigned long seed = 3) {
  std::vector<double> command(rows);
  for (std::size_t k = 0; k < rows; ++k)
    command[k] = std::sin(0.02 * static_cast<double>(k)) + (k / 100 % 2 == 0 ? 0.5 : -0.5);
  std::vector<double> q = CartMotion(1.2, 0.1, -0.3, command);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, noise);
  for (double& x : q) x += 0.05 + (noise > 0 ? normal(random) : 0);
  return MakeRecording(rig, std::move(command), std::move(q), kCartStep_s);
}

FitOptions CartOptions(const Rig& rig, ObjectiveKind objective) {
  return {.free = {rig.Index("cart.gain")},
          .objective = objective,
          .window_s = 0.5,
          .lead_in_s = 0.02,
          .time_step_s = kCartStep_s,
          .fit_shift = false};
}

double CostOf(FitProblem& problem, const FitPoint& point) { return problem.Evaluate(point, Keep::kCost).cost; }

FitPoint StatesSolved(FitProblem& problem, const FitPoint& point, int steps) {
  ProblemObjective objective(problem);
  Work work;
  return SolveStates(problem, objective, point, steps, &work);
}

double Deviation(const std::vector<double>& y) {
  double mean = 0, square = 0;
  for (const double x : y) mean += x / static_cast<double>(y.size());
  for (const double x : y) square += (x - mean) * (x - mean);
  return std::sqrt(square / static_cast<double>(y.size()));
}

// All residuals of the windows as one dense linear problem in (gain, offset, two states per window), by unit responses
// of the test's integrator.
struct Dense {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residual;  // at zero states and offset, the nominal gain
};
Dense DenseProblem(const Rig& rig, const Recording& recording, double lead_in_s) {
  const std::vector<LogWindow> windows = TakenWindows({recording}, {.window_s = 0.5});
  const auto& y = recording.measured.front().values;
  const double weight = 1 / Deviation(y), gain = rig.model->Nominal()[0];
  const double scale = std::max(1.5, 0.05 * 20);  // of the gain's coordinate
  const double prior = std::sqrt(5.0) * weight;
  std::vector<std::vector<double>> rows;
  std::vector<double> residual;
  const std::size_t columns = 2 + 2 * windows.size();
  for (std::size_t w = 0; w < windows.size(); ++w) {
    const Window window = windows[w].rows;
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
      row[2 + 2 * w + static_cast<std::size_t>(j)] = prior * (j == 0 ? 1 : kFitPolicy.speed_prior_s);
      rows.push_back(row);
      residual.push_back(0);
    }
  }
  Dense dense{.jacobian = Eigen::MatrixXd(rows.size(), columns),
              .residual = Eigen::Map<Eigen::VectorXd>(residual.data(), static_cast<Eigen::Index>(residual.size()))};
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (std::size_t c = 0; c < columns; ++c)
      dense.jacobian(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = rows[r][c];
  }
  return dense;
}

// A fast swing, read without noise: how far a window's speed at its start is from the true one, in deviations of what a
// fit is told of it. A wrong start that is trusted makes whatever makes up for it seem to be there.
TEST(FitProblemTest, AStartIsNoFartherOffThanItIsTrusted) {
  constexpr double kNoise = 1e-4, kSize = 0.05;
  const double w = 2 * M_PI * 10;
  const Rig rig = LoadCart();
  std::vector<double> q(501);
  for (std::size_t k = 0; k < q.size(); ++k) q[k] = kSize * std::sin(w * kCartStep_s * static_cast<double>(k) + 0.4);
  const std::vector<Recording> logs = {MakeRecording(rig, std::vector<double>(q.size(), 0.0), q, kCartStep_s)};
  ThreadPool pool(1);
  FitOptions options = CartOptions(rig, ObjectiveKind::kWindows);
  options.weights = {1 / kNoise};
  options.window_s = 0.13;  // starts at many phases
  const FitProblem problem(*rig.model, logs, options, rig.Values(), pool);
  int seen = 0;
  for (const FitWindow& window : problem.windows()) {
    if (window.rows.begin == 0) continue;  // one-sided
    const double speed = kSize * w * std::cos(w * logs[0].time_s[window.rows.begin] + 0.4);
    EXPECT_LT(std::abs(window.start.qvel[0] - speed) * window.prior[1], 2) << window.rows.begin;
    ++seen;
  }
  EXPECT_GT(seen, 5);
}

TEST(FitProblemTest, CostIsHalfTheSumOfSquares) {
  const Rig rig = LoadCart();
  const std::vector<Recording> logs = {CartLog(rig, 501, 0.01)};
  ThreadPool pool(1);
  FitProblem problem(*rig.model, logs, CartOptions(rig, ObjectiveKind::kWindows), rig.model->Nominal(), pool);
  const Dense dense = DenseProblem(rig, logs[0], 0.02);
  EXPECT_NEAR(CostOf(problem, problem.Start()), 0.5 * dense.residual.squaredNorm(),
              kRounding * dense.residual.squaredNorm());
}

TEST(FitProblemTest, EliminatedStatesGiveTheFullProblemsNormalEquations) {
  const Rig rig = LoadCart();
  const std::vector<Recording> logs = {CartLog(rig, 501, 0.01)};
  ThreadPool pool(1);
  FitProblem problem(*rig.model, logs, CartOptions(rig, ObjectiveKind::kWindows), rig.model->Nominal(), pool);
  const Linearization at = Linearize(problem, problem.Start(), {.step = 0.05});
  ASSERT_TRUE(at.valid);
  const Dense dense = DenseProblem(rig, logs[0], 0.02);
  const Eigen::MatrixXd full = dense.jacobian.transpose() * dense.jacobian;
  const Eigen::VectorXd slope = dense.jacobian.transpose() * dense.residual;
  const Eigen::Index m = full.rows() - 2;
  const Eigen::MatrixXd inner = full.bottomRightCorner(m, m).inverse();
  const Eigen::MatrixXd reduced =
      full.topLeftCorner(2, 2) - full.topRightCorner(2, m) * inner * full.bottomLeftCorner(m, 2);
  const Eigen::VectorXd gradient = slope.head(2) - full.topRightCorner(2, m) * inner * slope.tail(m);
  // The anchor adds 1e-8 of the residuals' count over the squared range.
  EXPECT_LT((at.hessian - reduced).norm(), 1e-6 * reduced.norm());
  EXPECT_LT((at.gradient - gradient).norm(), 1e-6 * gradient.norm());
  // One full step lands on the solution of the whole problem: its cost is that of the dense solution.
  const Eigen::VectorXd solution = full.ldlt().solve(-slope);
  const FitPoint moved = Move(problem, problem.Start(), at, at.hessian.ldlt().solve(-at.gradient));
  EXPECT_LT((moved.y - problem.Start().y - solution.head(2)).norm(), 1e-4 * solution.head(2).norm());
  for (std::size_t w = 0; w < problem.windows().size(); ++w) {
    EXPECT_LT((moved.states[w] - solution.segment<2>(2 + 2 * static_cast<Eigen::Index>(w))).norm(), 1e-4);
  }
  EXPECT_NEAR(CostOf(problem, moved), 0.5 * (dense.residual + dense.jacobian * solution).squaredNorm(),
              1e-6 * CostOf(problem, problem.Start()));
}

TEST(FitProblemTest, GradientIsThatOfTheReducedCost) {
  // The Qube is not linear: the reduced cost is found by solving the states at every point.
  const Rig rig = LoadRig("qube");
  const auto truth = rig.Values({{"arm.damping", 3e-4}, {"motor.kt", 0.038}});
  const auto command = [](double t) { return 1.5 * std::sin(6 * t + 2 * t * t); };
  const std::vector<Recording> logs = {MakeLog(rig, truth, command, 2, 0.004, 2e-3, 1)};
  ThreadPool pool(2);
  FitProblem problem(
      *rig.model, logs,
      {.free = {rig.Index("motor.kt"), rig.Index("arm.damping")}, .time_step_s = 0.004, .fit_offsets = false},
      rig.model->Nominal(), pool);
  FitPoint point = StatesSolved(problem, problem.Start(), 6);
  const Linearization at = Linearize(problem, point, {.step = 1e-3});
  for (Eigen::Index i = 0; i < point.y.size(); ++i) {
    const double h = i + 1 < point.y.size() ? 2e-3 : 0.1;  // the shift is linear between samples
    double cost[2];
    for (int side = 0; side < 2; ++side) {
      FitPoint other = point;
      other.y[i] += side == 0 ? -h : h;
      cost[side] = CostOf(problem, StatesSolved(problem, other, 6));
    }
    EXPECT_NEAR(at.gradient[i], (cost[1] - cost[0]) / (2 * h), 0.02 * at.gradient.norm()) << i;
  }
}

TEST(FitProblemTest, HuberGrowsLinearlyBeyondTheThreshold) {
  const Rig rig = LoadCart();
  Recording log = CartLog(rig, 501, 0.01);
  ThreadPool pool(1);
  FitOptions options = CartOptions(rig, ObjectiveKind::kFreeRun);
  options.huber = 4;
  options.fit_offsets = options.fit_states = false;
  const auto cost_with_outlier = [&](double outlier, bool robust) {
    std::vector<Recording> logs = {log};
    logs[0].measured[0].values[250] += outlier;
    options.weights = {1.0};
    FitProblem problem(*rig.model, logs, options, rig.Values({{"cart.gain", 1.2}}), pool);
    if (robust) problem.SetHuberThreshold(problem.Evaluate(problem.Start(), Keep::kResiduals).residuals);
    return CostOf(problem, problem.Start());
  };
  // Far out: quadratic without, linear with.
  const double plain[] = {cost_with_outlier(10, false), cost_with_outlier(20, false)},
               robust[] = {cost_with_outlier(10, true), cost_with_outlier(20, true), cost_with_outlier(30, true)};
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
  FitOptions options = CartOptions(rig, ObjectiveKind::kFreeRun);
  FitProblem problem(*rig.model, logs, options, rig.model->Nominal(), pool);
  const SolveResult found = Solve(problem, problem.Start(), {.tolerance = 1e-10});
  EXPECT_NEAR(problem.Values(found.point)[0], 1.2, 1e-3);
}

// On a linear problem a secant step leaves a Jacobian that explains the step, and normal equations with the cost of the
// new point.
TEST(FitProblemTest, SecantUpdateExplainsItsStep) {
  const Rig rig = LoadRig("qube");
  const auto command = [](double t) { return 1.5 * std::sin(6 * t + 2 * t * t); };
  const std::vector<Recording> logs = {MakeLog(rig, rig.Values({{"arm.damping", 3e-4}}), command, 2, 0.004, 2e-3, 1)};
  ThreadPool pool(1);
  FitProblem problem(*rig.model, logs,
                     {.free = {rig.Index("motor.kt"), rig.Index("arm.damping")}, .time_step_s = 0.004},
                     rig.model->Nominal(), pool);
  const FitPoint from = problem.Start();
  Derivatives snapshot = problem.Differentiate(from, {.step = 0.01});
  const std::vector<Eigen::VectorXd> before = snapshot.residuals;
  FitPoint to = from;
  to.y[0] += 0.05;
  to.y[1] -= 0.3;
  to.states[1][0] += 0.01;
  const Evaluation evaluation = problem.Evaluate(to, Keep::kResiduals);
  const double cost = evaluation.cost;
  Residuals after = evaluation.residuals;
  const std::vector<Eigen::VectorXd> kept = after;
  UpdateSecant(problem, snapshot, from, to, std::move(after));
  for (std::size_t w = 0; w < problem.windows().size(); ++w) {
    Eigen::VectorXd moved(snapshot.jacobians[w].cols());
    moved << to.y - from.y, to.states[w] - from.states[w];
    EXPECT_LT((snapshot.jacobians[w] * moved - (kept[w] - before[w])).norm(), 1e-9 * kept[w].norm()) << w;
  }
  EXPECT_NEAR(Reduce(problem, to, snapshot, Blocks::kNone).cost, cost, 1e-12 * cost);
}

// Quick steps differ from the model's own by the order of an Euler step: their differences do, and costs not at all.
TEST(QuickDifferencesTest, AreOffByAnEulerStep) {
  const Rig rig = LoadRig("qube");
  const auto command = [](double t) { return 1.5 * std::sin(6 * t + 2 * t * t); };
  const std::vector<Recording> logs = {MakeLog(rig, rig.Values({{"arm.damping", 3e-4}}), command, 2, 0.004, 2e-3, 1)};
  ThreadPool pool(1);
  const auto off = [&](double step_s) {
    FitProblem problem(*rig.model, logs,
                       {.free = {rig.Index("motor.kt"), rig.Index("arm.damping")}, .time_step_s = step_s},
                       rig.model->Nominal(), pool);
    const FitPoint at = problem.Start();
    const Derivatives own = problem.Differentiate(at, {.step = 0.03}),
                      quick = problem.Differentiate(at, {.step = 0.03, .steps = StepKind::kQuick});
    EXPECT_LT(quick.work.steps, own.work.steps / 2);
    double difference = 0, size = 0;
    for (std::size_t w = 0; w < problem.windows().size(); ++w) {
      EXPECT_EQ(own.residuals[w], quick.residuals[w]) << w;
      difference += (own.jacobians[w] - quick.jacobians[w]).squaredNorm();
      size += own.jacobians[w].squaredNorm();
    }
    return std::sqrt(difference / size);
  };
  const double whole = off(0.004), half = off(0.002);
  EXPECT_LT(whole, 0.05);
  EXPECT_GT(whole, 1e-4);
  EXPECT_NEAR(half / whole, 0.5, 0.1);
}

// A step of a linear problem does not bend; a product of two parameters does, as its second derivative says.
TEST(BendTest, IsTheSecondDerivativeAlongTheStep) {
  const Rig rig = LoadCart();
  const std::vector<Recording> logs = {CartLog(rig, 501, 0.01)};
  ThreadPool pool(1);
  FitProblem problem(*rig.model, logs, CartOptions(rig, ObjectiveKind::kWindows), rig.model->Nominal(), pool);
  const FitPoint from = problem.Start();
  const Derivatives snapshot = problem.Differentiate(from, {.step = 0.05});
  const Linearization at = Reduce(problem, from, snapshot, Blocks::kNone);
  FitPoint to = from, probe = from;
  to.y[0] += 0.3;
  probe.y[0] += 0.03;
  Residuals residuals = problem.Evaluate(probe, Keep::kResiduals).residuals;
  EXPECT_LT(Bend(problem, at, snapshot, from, to, {0.1, residuals}).gradient.norm(), 1e-6 * at.gradient.norm());
  // Residuals that are off by share^2 times their Jacobian's first column are what a bend of the unit vector's size
  // makes.
  for (std::size_t w = 0; w < residuals.size(); ++w) residuals[w] += 0.01 * snapshot.jacobians[w].col(0);
  const Linearization bent = Bend(problem, at, snapshot, from, to, {0.1, residuals});
  Eigen::MatrixXd hessian = at.hessian;
  hessian.diagonal() -= problem.prior().weight;
  EXPECT_LT((bent.gradient - hessian.col(0)).norm(), 1e-5 * hessian.col(0).norm());
}

TEST(TakeBetterStatesTest, EveryWindowKeepsTheStateThatCostsLess) {
  const Rig rig = LoadCart();
  const std::vector<Recording> logs = {CartLog(rig, 501, 0.01)};
  ThreadPool pool(1);
  FitProblem problem(*rig.model, logs, CartOptions(rig, ObjectiveKind::kWindows), rig.model->Nominal(), pool);
  ASSERT_GT(problem.windows().size(), 2u);
  // One of the two is spoilt in even windows, the other in odd ones.
  FitPoint a = problem.Start(), b = problem.Start();
  for (std::size_t w = 0; w < problem.windows().size(); ++w) (w % 2 == 0 ? a : b).states[w][0] += 3;
  Residuals of_a = problem.Evaluate(a, Keep::kResiduals).residuals,
            of_b = problem.Evaluate(b, Keep::kResiduals).residuals;
  const double cost = TakeBetterStates(problem, a, of_a, b, of_b);
  EXPECT_NEAR(cost, CostOf(problem, problem.Start()), 1e-12 * cost);
  EXPECT_NEAR(cost, CostOf(problem, a), 1e-12 * cost);
}

// Of a quadratic cost it is known what pays: where the whole step goes 2.6 times as far as the best state, half of it;
// 4 times, a quarter; backwards, nothing; to the best state, all.
TEST(ShortenStatesTest, EveryWindowGoesAsFarAsPays) {
  const Rig rig = LoadCart();
  const std::vector<Recording> logs = {CartLog(rig, 801, 0)};
  ThreadPool pool(1);
  FitProblem problem(*rig.model, logs, CartOptions(rig, ObjectiveKind::kWindows), rig.model->Nominal(), pool);
  const FitPoint best = StatesSolved(problem, problem.Start(), 3);
  constexpr double kGoes[] = {2.6, 4, -1, 1}, kPays[] = {0.5, 0.25, 0, 1};
  ASSERT_GE(problem.windows().size(), std::size(kGoes));
  FitPoint from = best, whole = best, expected = best;
  for (std::size_t w = 0; w < problem.windows().size(); ++w) {
    const Eigen::Vector2d away(0.1, -0.2);
    const double goes = kGoes[w % std::size(kGoes)];
    from.states[w] += away;
    whole.states[w] = from.states[w] - goes * away;
    expected.states[w] = from.states[w] - kPays[w % std::size(kPays)] * goes * away;
  }
  Residuals residuals = problem.Evaluate(whole, Keep::kResiduals).residuals;
  Work work;
  const double cost = ShortenStates(problem, from.states, whole, residuals, &work);
  for (std::size_t w = 0; w < problem.windows().size(); ++w)
    EXPECT_LT((whole.states[w] - expected.states[w]).norm(), kRounding) << w;
  EXPECT_NEAR(cost, CostOf(problem, expected), 1e-9 * cost);
}

// What went before a window is in the drive's states when it starts: with the true effect nothing is left but the
// start's own small error.
TEST(FitProblemTest, DrivesHoldTheirPastAtAWindowsStart) {
  const auto command = [](double t) { return 2 * std::sin(9 * t + 1.5 * t * t); };
  for (const auto& [rig_name, changed] :
       {std::pair<std::string, std::map<std::string, double>>{
            "flexjoint", {{"actuator_lag@motor.time_constant_s", 0.04}, {"actuator_lag@motor.second_pole_share", 0.2}}},
        {"qube",
         {{"supply_sag@motor.time_constant_s", 0.5},
          {"supply_sag@motor.sag_fraction", 0.5},
          {"supply_sag@motor.limit_n_m", 0.008}}},
        {"joint", {{"torque_delay@motor.delay_s", 0.02}}}}) {
    const std::string effect = changed.begin()->first.substr(0, changed.begin()->first.find('.'));
    const Rig rig = LoadRig(rig_name, {effect});
    const auto values = rig.Values(changed);
    const std::vector<Recording> logs = {MakeLog(rig, values, command, 5, 0.002, 0, 1)};
    ThreadPool pool(1);
    const FitOptions options{.time_step_s = 0.002, .fit_offsets = false, .fit_shift = false};
    FitProblem truth(*rig.model, logs, options, values, pool),
        nothing(*rig.model, logs, options, rig.model->Nominal(), pool);
    const double left = CostOf(truth, StatesSolved(truth, truth.Start(), 3)),
                 without = CostOf(nothing, StatesSolved(nothing, nothing.Start(), 3));
    EXPECT_LT(left, 0.003 * without) << effect;
  }
}

// A late sensor shows a window's start only later: the window starts where the mechanism was, and the true delay leaves
// nothing.
TEST(FitProblemTest, LateSensorStartsWhereTheMechanismWas) {
  const Rig rig = LoadRig("joint", {"sensor_delay@position_rad"});
  const auto values = rig.Values({{"sensor_delay@position_rad.delay_s", 0.012}});
  const auto command = [](double t) { return 0.4 * std::sin(8 * t); };
  Recording log = MakeLog(rig, values, command, 3, 0.001, 0, 1);
  const std::vector<Recording> logs = {log};
  const InitialState start = InitialStateAt(*rig.model, log, 1000, values),
                     late = InitialStateAt(*rig.model, log, 1000, rig.model->Nominal());
  const double later = InitialStateAt(*rig.model, log, 1012, rig.model->Nominal()).qpos[0];
  EXPECT_NEAR(start.qpos[0], later, 1e-9);
  EXPECT_GT(std::abs(late.qpos[0] - later), 1e-3);
  ThreadPool pool(1);
  const FitOptions options{.free = {rig.Index("sensor_delay@position_rad.delay_s")},
                           .time_step_s = 0.001,
                           .fit_offsets = false,
                           .fit_shift = false,
                           .fit_states = false};
  FitProblem problem(*rig.model, logs, options, values, pool);
  FitProblem from_nothing(*rig.model, logs, options, rig.model->Nominal(), pool);
  FitPoint point = from_nothing.Start();
  const double before = CostOf(from_nothing, point);
  point.y = problem.Start().y;
  EXPECT_LT(CostOf(from_nothing, point), 1e-4 * before);
}

// A held-out error is of the rows that a fit looks at: what a window's start is wrong by shows in forces before them.
// A problem of two of the windows, and one of all.
TEST(CarryOverTest, StatesGoWithTheirWindows) {
  const Rig rig = LoadCart();
  const std::vector<Recording> logs = {CartLog(rig, 501, 0.01, 1), CartLog(rig, 501, 0.01, 2)};
  ThreadPool pool(1);
  FitOptions options = CartOptions(rig, ObjectiveKind::kWindows);
  FitProblem all(*rig.model, logs, options, rig.model->Nominal(), pool);
  ASSERT_GT(all.windows().size(), 4u);
  std::vector<LogWindow> few;
  for (const std::size_t w : {std::size_t{1}, all.windows().size() - 1})
    few.push_back({all.windows()[w].log, all.windows()[w].rows});
  options.windows = std::make_shared<const std::vector<LogWindow>>(few);
  FitProblem part(*rig.model, logs, options, rig.model->Nominal(), pool);
  ASSERT_EQ(part.windows().size(), 2u);
  FitPoint point = part.Start();
  point.y.setConstant(0.3);
  for (auto& state : point.states) state.setConstant(0.01);
  const FitPoint carried = CarryOver(part, point, all, rig.model->Nominal());
  const FitPoint start = all.Start();
  EXPECT_LT((carried.y - point.y).norm(), kRounding);
  for (std::size_t w = 0; w < all.windows().size(); ++w) {
    const bool shared = w == 1 || w + 1 == all.windows().size();
    EXPECT_EQ(carried.states[w], shared ? Eigen::VectorXd(point.states[0]) : start.states[w]) << w;
  }
  EXPECT_EQ(CarryOver(all, carried, part, rig.model->Nominal()).states, point.states);
}

TEST(FitProblemTest, LeadInsAreNotPredicted) {
  const Rig rig = LoadCart();
  const std::vector<Recording> logs = {CartLog(rig, 400, 0)};
  ThreadPool pool(1);
  FitProblem problem(*rig.model, logs, CartOptions(rig, ObjectiveKind::kWindows), rig.model->Nominal(), pool);
  const std::vector<double> predicted = problem.Predict(problem.Start()).front().signals.front().predicted;
  for (const FitWindow& window : problem.windows()) {
    EXPECT_GT(window.first_scored, 3u);
    for (std::size_t r = 1; r < window.rows.rows(); ++r)
      EXPECT_EQ(std::isfinite(predicted[window.rows.begin + r]), r >= window.first_scored) << window.rows.begin + r;
  }
}

// The truth lies beyond a bound that the options ask for; without it the fit reaches it.
TEST(FitProblemTest, BoundsOfTheOptionsGoFirst) {
  const Rig rig = LoadCart();
  const std::vector<Recording> logs = {CartLog(rig, 600, 0)};
  ThreadPool pool{1};
  FitOptions options = CartOptions(rig, ObjectiveKind::kWindows);
  const auto index = static_cast<std::size_t>(rig.Index("cart.gain"));
  const auto gain = [&] {
    std::vector<double> start = rig.model->Nominal();
    start[index] = 0.5;
    FitProblem problem(*rig.model, logs, options, start, pool);
    return problem.Values(Solve(problem, problem.Start(), {}).point)[index];
  };
  EXPECT_NEAR(gain(), 1.2, 1e-3);
  options.bounds["cart.gain"] = {-10, 1};
  EXPECT_NEAR(gain(), 1, 1e-6);
}

// The gain is known to lie near nominal, the log says otherwise, and leaves much more than the noise that is stated.
class KnownGainTest : public ::testing::Test {
 protected:
  KnownGainTest() {
    options_.weights = {1e4};
    options_.prior_share = 0.005;
    options_.prior_scale = 10;
  }
  FitProblem Problem() { return FitProblem(*rig_.model, logs_, options_, rig_.model->Nominal(), pool_); }
  const Rig rig_ = LoadCart();
  const std::vector<Recording> logs_ = {CartLog(rig_, 501, 0.02)};
  ThreadPool pool_{1};
  FitOptions options_ = CartOptions(rig_, ObjectiveKind::kWindows);
};

TEST_F(KnownGainTest, WhatIsKnownCountsAgainstTheVarianceThatIsLeft) {
  FitProblem problem = Problem();
  const double count = static_cast<double>(problem.residuals());
  FitPoint point = problem.Start();
  // Fits with the variance that the last one left, until it stays.
  double variance = 1;
  for (int round = 0; round < 20; ++round) {
    problem.CountKnown(variance);
    point = Solve(problem, point, {.tolerance = 1e-10}).point;
    variance = 2 * (CostOf(problem, point) - problem.prior().scale * problem.prior().Surprise(point.y)) / count;
  }
  EXPECT_GT(variance, 100);
  const auto any = [&](double gain, double counted) {
    problem.CountKnown(counted);
    FitPoint moved = point;
    moved.y[0] += gain;
    moved = StatesSolved(problem, moved, 2);
    return problem.CostOfAnyVariance(CostOf(problem, moved), moved.y);
  };
  EXPECT_NEAR(any(0.01, 1), any(0.01, variance), 1e-9 * any(0, 1));
  EXPECT_LT(any(0, 1), any(0.003, 1));
  EXPECT_LT(any(0, 1), any(-0.003, 1));
  // The data alone lie elsewhere: that is not their optimum.
  options_.prior_share = 0;
  FitProblem free = Problem();
  const double nominal = rig_.model->Nominal()[0];
  EXPECT_LT(std::abs(problem.Values(point)[0] - nominal),
            0.5 * std::abs(free.Values(Solve(free, free.Start(), {}).point)[0] - nominal));
}

TEST_F(KnownGainTest, AWiderSearchKnowsNoLess) {
  const auto deviation = [&] {
    const FitProblem problem = Problem();
    return problem.space().coordinates()[0].scale / std::sqrt(problem.prior().known[0]);
  };
  const Parameter& gain = rig_.model->parameters()[0];
  EXPECT_NEAR(deviation(), options_.prior_share * (gain.high - gain.low), 1e-12);
  options_.bounds["cart.gain"] = {-100, 100};
  EXPECT_NEAR(deviation(), options_.prior_share * (gain.high - gain.low), 1e-12);
}

}  // namespace
}  // namespace gapscope::testing
