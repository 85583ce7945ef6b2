// What is measured of joints that touch, and columns made together against columns made one by one.
#include "src/fit/coupling.h"

#include <gtest/gtest.h>

#include <cmath>

#include "src/fit/gram.h"
#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

constexpr double kStep = 0.01;
const DifferenceOptions kQuick{.step = kStep, .steps = StepKind::kQuick};

// Three carts, each under its own command.
struct Bench {
  Rig rig;
  std::vector<Recording> logs;
  ThreadPool pool{1};
  explicit Bench(bool linked) : rig(LoadThreeCarts(linked)) {
    logs = {MakeLog(rig, rig.model->Nominal(), [](double) { return 0.0; }, 2, kCartStep_s, 1e-4, 1)};
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t k = 0; k < logs[0].rows(); ++k)
        logs[0].commands[c].values[k] = std::sin((3.0 + static_cast<double>(c)) * logs[0].time_s[k]);
    }
  }
  FitOptions Options(std::shared_ptr<const Coupling> coupling = nullptr) const {
    return {.free = rig.model->FreeParameters(), .coupling = std::move(coupling), .time_step_s = kCartStep_s};
  }
  FitProblem Problem(std::shared_ptr<const Coupling> coupling = nullptr) {
    return {*rig.model, logs, Options(std::move(coupling)), rig.model->Nominal(), pool};
  }
  std::vector<ProbeTorque> Probes() const {
    std::vector<ProbeTorque> probes;
    for (int joint = 0; joint < 3; ++joint)
      probes.push_back({.joint = joint, .amplitude_n_m = 0.1, .per_rad = 2, .phase_rad = 1.0 + joint});
    return probes;
  }
  std::shared_ptr<const Coupling> Measured() {
    FitProblem problem = Problem();
    Work work;
    return std::make_shared<const Coupling>(Coupling::Measure(problem, problem.Start(), Probes(), &work));
  }
};

using Groups = std::vector<std::vector<std::size_t>>;

TEST(ApartGroupsTest, MembersShareNoSignal) {
  EXPECT_EQ(ApartGroups({{1, 0, 0}, {1, 1, 0}, {0, 0, 1}, {0, 1, 0}}), (Groups{{0, 2, 3}, {1}}));
  EXPECT_EQ(ApartGroups({{}, {1, 0}, {}, {0, 1}}), (Groups{{0}, {1, 3}, {2}}));  // what moves all is alone
}

TEST(CouplingTest, CartsThatStandApartMoveTheirOwnSignals) {
  Bench bench(false);
  const auto coupling = bench.Measured();
  const gapscope::Rig& rig = *bench.rig.model->rig();
  EXPECT_EQ(coupling->OfPlace("b", rig), (MovedSignals{0, 1, 0}));
  EXPECT_EQ(coupling->OfPlace("c_m", rig), (MovedSignals{0, 0, 1}));
  EXPECT_EQ(coupling->OfParameter("a.damping", rig), (MovedSignals{1, 0, 0}));
  EXPECT_EQ(coupling->OfParameter("coulomb_friction@c.friction_n_m", rig), (MovedSignals{0, 0, 1}));
  EXPECT_EQ(coupling->OfState(1), (MovedSignals{0, 1, 0}));
  EXPECT_TRUE(coupling->OfPlace("all", rig).empty());
  EXPECT_EQ(coupling->limb_count(), 3U);
  EXPECT_EQ(coupling->LimbOf(2), 2U);
  EXPECT_EQ(coupling->LimbsOf({0, 1, 0}), (std::vector<char>{0, 1, 0}));
  EXPECT_EQ(coupling->LimbsOf({}), (std::vector<char>{1, 1, 1}));
}

// A force on the lower cart moves the upper one relative to it, and the other way round.
TEST(CouplingTest, ACartOnAnotherTouchesIt) {
  Bench bench(true);
  const auto coupling = bench.Measured();
  const gapscope::Rig& rig = *bench.rig.model->rig();
  EXPECT_EQ(coupling->OfPlace("a", rig), (MovedSignals{1, 0, 0}));
  EXPECT_EQ(coupling->OfPlace("b", rig), (MovedSignals{0, 1, 1}));
  EXPECT_EQ(coupling->OfPlace("c", rig), (MovedSignals{0, 1, 1}));
  EXPECT_EQ(coupling->limb_count(), 2U);
  EXPECT_EQ(coupling->LimbOf(1), coupling->LimbOf(2));
  EXPECT_NE(coupling->LimbOf(0), coupling->LimbOf(1));
}

TEST(CouplingTest, WhereNothingIsKnownThereIsOneLimb) {
  const Coupling coupling;
  EXPECT_EQ(coupling.limb_count(), 1U);
  EXPECT_EQ(coupling.LimbOf(7), 0U);
  EXPECT_EQ(coupling.LimbsOf({1, 0}), (std::vector<char>{1}));
}

// What parts by limbs say is what each cart's own signals say, its states' priors with it.
TEST(CouplingTest, PartsByLimbAreTheLimbsOwnProducts) {
  Bench bench(false);
  FitProblem problem = bench.Problem();
  const auto coupling = bench.Measured();
  FitPoint point = problem.Start();
  for (auto& state : point.states) state.setConstant(1e-3);
  const GramParts by_limb{.count = 3,
                          .of = [&](std::size_t, long, std::size_t signal) { return coupling->LimbOf(signal); }};
  const GramSystem whole = MakeGram(problem, point, {}, kQuick), limbs = MakeGram(problem, point, {}, kQuick, by_limb);
  const Eigen::MatrixXd sum = limbs.parts[0] + limbs.parts[1] + limbs.parts[2];
  EXPECT_LT((sum - whole.parts[0]).norm(), 1e-9 * sum.norm());
  for (std::size_t i = 0; i < whole.columns.size(); ++i) {
    const std::string& column = whole.columns[i];
    const auto at = static_cast<Eigen::Index>(i);
    for (std::size_t limb = 0; limb < 3; ++limb) {
      const std::string name(1, static_cast<char>('a' + limb));
      if (!column.starts_with(name + ".") && column != "offset " + name + "_m log 0") continue;
      for (std::size_t other = 0; other < 3; ++other) {
        const double expected = other == limb ? whole.parts[0](at, at) : 0;
        EXPECT_NEAR(limbs.parts[other](at, at), expected, 1e-6 * whole.parts[0](at, at)) << column << " " << other;
      }
    }
  }
}

// Products are made for each cart by itself, with its own states taken out; normal equations take all states out of
// all.
TEST(CouplingTest, ProductsOfCartsApartAreThoseOfAllTogether) {
  for (const double huber : {0.0, 2.0}) {
    Bench bench(false);
    FitOptions options = bench.Options(bench.Measured());
    options.huber = huber;
    FitProblem problem(*bench.rig.model, bench.logs, options, bench.rig.model->Nominal(), bench.pool);
    FitPoint point = problem.Start();
    for (auto& state : point.states) state.setConstant(1e-3);
    problem.SetHuberThreshold(problem.Evaluate(point, Keep::kResiduals).residuals);
    const Linearization at = Linearize(problem, point, {.step = kStep});
    const GramSystem gram = MakeGram(problem, point, {}, {.step = kStep});
    ASSERT_TRUE(at.valid && gram.valid);
    const Eigen::Index n = gram.parameters;
    Eigen::MatrixXd hessian = gram.parts[0].topLeftCorner(n, n);
    hessian.diagonal() += problem.prior().weight;
    const Eigen::VectorXd gradient = gram.parts[0].col(n).head(n) + problem.prior().Gradient(point.y);
    EXPECT_LT((hessian - at.hessian).norm(), 1e-12 * at.hessian.norm()) << huber;
    EXPECT_LT((gradient - at.gradient).norm(), 1e-12 * at.gradient.norm()) << huber;
  }
}

// Each cart's half seconds are blocks of their own, in which the others' parameters have no slope.
TEST(CouplingTest, BlocksOfACovarianceAreOfOneLimb) {
  Bench bench(false);
  FitProblem whole = bench.Problem(), limbs = bench.Problem(bench.Measured());
  FitPoint point = whole.Start();
  point.y[0] += 0.05;
  const DifferenceOptions central{.step = kStep, .columns = DifferenceOptions::Columns::kCentral};
  const Linearization by_time = Linearize(whole, point, central), by_limb = Linearize(limbs, point, central);
  ASSERT_EQ(by_limb.block_gradients.size(), 3 * by_time.block_gradients.size());
  Eigen::VectorXd sums[] = {by_time.block_gradients[0], by_time.block_gradients[0]};
  sums[0].setZero(), sums[1].setZero();
  for (const auto& gradient : by_time.block_gradients) sums[0] += gradient;
  for (const auto& gradient : by_limb.block_gradients) sums[1] += gradient;
  EXPECT_LT((sums[0] - sums[1]).norm(), 1e-6 * sums[0].norm());
  for (std::size_t i = 0; i < bench.rig.model->FreeParameters().size(); ++i) {
    const std::size_t cart =
        static_cast<std::size_t>(limbs.space().parameter(limbs.space().coordinates()[i]).name[0] - 'a');
    for (std::size_t b = 0; b < by_limb.block_gradients.size(); ++b) {
      if (by_limb.block_series[b] != static_cast<int>(cart)) {
        EXPECT_EQ(by_limb.block_gradients[b][static_cast<Eigen::Index>(i)], 0);
      }
    }
  }
}

TEST(CouplingTest, AJacobianMadeTogetherIsTheOneMadeColumnByColumn) {
  for (const bool linked : {false, true}) {
    Bench bench(linked);
    FitProblem alone = bench.Problem(), together = bench.Problem(bench.Measured());
    const Derivatives a = alone.Differentiate(alone.Start(), kQuick),
                      b = together.Differentiate(together.Start(), kQuick);
    ASSERT_TRUE(a.valid && b.valid);
    for (std::size_t w = 0; w < a.jacobians.size(); ++w) {
      for (Eigen::Index i = 0; i < a.jacobians[w].cols(); ++i)
        EXPECT_LT((a.jacobians[w].col(i) - b.jacobians[w].col(i)).norm(), 1e-9 + 1e-6 * a.jacobians[w].col(i).norm())
            << linked << w << " " << i;
    }
    // Residuals, and what is differenced: the same by quick steps, gains, dampings, angles, speeds and the shift.
    if (!linked) {
      EXPECT_EQ(b.work.replays, 7u);
    }
    EXPECT_LT(b.work.replays, a.work.replays);
    EXPECT_LT(b.work.steps, a.work.steps);
    // What sizes and intervals rest on is never made together.
    const DifferenceOptions central{.step = kStep, .columns = DifferenceOptions::Columns::kCentral};
    const Derivatives c = alone.Differentiate(alone.Start(), central),
                      d = together.Differentiate(together.Start(), central);
    EXPECT_EQ(c.jacobians, d.jacobians);
    EXPECT_EQ(c.work.replays, d.work.replays);
  }
}

TEST(CouplingTest, TorquesInOneReplayAreThoseOfThreeReplays) {
  Bench bench(false);
  FitProblem problem = bench.Problem();
  const auto coupling = bench.Measured();
  const std::vector<double> values = bench.rig.model->Nominal();
  std::vector<ExtraColumn> apart, together;
  for (const ProbeTorque& probe : bench.Probes()) {
    apart.push_back({.name = "torque", .child = &problem, .values = values, .probes = {probe}});
    ExtraColumn column{.name = "torque", .child = &problem, .values = values, .probes = bench.Probes()};
    column.moved = coupling->OfPlace(std::string(1, static_cast<char>('a' + probe.joint)), *bench.rig.model->rig());
    together.push_back(std::move(column));
  }
  const GramSystem a = MakeGram(problem, problem.Start(), apart, kQuick),
                   b = MakeGram(problem, problem.Start(), together, kQuick);
  const Eigen::MatrixXd& sum = a.parts[0];
  EXPECT_LT((sum - b.parts[0]).norm(), 1e-9 * sum.norm());
  EXPECT_EQ(a.work.replays, b.work.replays + 2);
}

}  // namespace
}  // namespace gapscope::testing
