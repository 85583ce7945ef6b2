// Feedback designs against closed forms and published values.
#include "src/design/linear.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <numbers>

namespace gapscope {
namespace {

using Eigen::MatrixXd;
using Complex = std::complex<double>;

// x'' = u, weights q on the position and r: K = [sqrt(q/r), sqrt(2) (q/r)^(1/4)] (Anderson and Moore, "Optimal
// Control", 1990, 3.1).
TEST(LqrTest, DoubleIntegrator) {
  constexpr double kTolerance = 1e-10;
  MatrixXd a(2, 2), b(2, 1), q = MatrixXd::Zero(2, 2), r(1, 1);
  a << 0, 1, 0, 0;
  b << 0, 1;
  for (const double ratio : {1e-4, 1.0, 10.0, 1e6}) {
    q(0, 0) = ratio, r(0, 0) = 1;
    const auto k = Lqr(a, b, q, r);
    ASSERT_TRUE(k.ok()) << k.error().Text();
    EXPECT_NEAR(k.value().gain(0, 0) / std::sqrt(ratio), 1, kTolerance);
    EXPECT_NEAR(k.value().gain(0, 1) / (std::sqrt(2.0) * std::pow(ratio, 0.25)), 1, kTolerance);
  }
}

// An unstable pole s = p with no weight is mirrored: the cheapest stabilising feedback is 2 p / b, at the pole -p.
TEST(LqrTest, MirrorsAnUnstablePoleWithoutWeight) {
  const MatrixXd a = MatrixXd::Constant(1, 1, 3), b = MatrixXd::Constant(1, 1, 2), q = MatrixXd::Zero(1, 1),
                 r = MatrixXd::Constant(1, 1, 5);
  const auto k = Lqr(a, b, q, r);
  ASSERT_TRUE(k.ok());
  EXPECT_NEAR(k.value().gain(0, 0), 3, 1e-10);
  EXPECT_NEAR(k.value().poles[0].real(), -3, 1e-10);
}

// The inverted pendulum on a cart of the Michigan control tutorials (ctms.engin.umich.edu, "Inverted Pendulum:
// State-Space Methods for Controller Design"): M 0.5, m 0.2, b 0.1, I 0.006, l 0.3; Q = diag(1, 0, 1, 0), R = 1 gives K
// = [-1.0000 -1.6567 18.6854 3.4594]; Q = diag(5000, 0, 100, 0): K = [-70.7107 -37.8345 105.5298 20.9238].
TEST(LqrTest, PublishedCartPendulum) {
  const double M = 0.5, m = 0.2, damping = 0.1, I = 0.006, g = 9.8, l = 0.3, p = I * (M + m) + M * m * l * l;
  MatrixXd a(4, 4), b(4, 1), q = MatrixXd::Zero(4, 4);
  a << 0, 1, 0, 0, 0, -(I + m * l * l) * damping / p, m * m * g * l * l / p, 0, 0, 0, 0, 1, 0, -m * l * damping / p,
      m * g * l * (M + m) / p, 0;
  b << 0, (I + m * l * l) / p, 0, m * l / p;
  const MatrixXd r = MatrixXd::Identity(1, 1);
  constexpr double kPrinted = 6e-5;
  q(0, 0) = 1, q(2, 2) = 1;
  auto k = Lqr(a, b, q, r);
  ASSERT_TRUE(k.ok());
  const double first[] = {-1.0000, -1.6567, 18.6854, 3.4594};
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(k.value().gain(0, i), first[i], kPrinted) << i;
  q(0, 0) = 5000, q(2, 2) = 100;
  k = Lqr(a, b, q, r);
  ASSERT_TRUE(k.ok());
  const double second[] = {-70.7107, -37.8345, 105.5298, 20.9238};
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(k.value().gain(0, i), second[i], kPrinted) << i;
  // The Riccati equation itself.
  const MatrixXd& x = k.value().cost;
  EXPECT_LT((a.transpose() * x + x * a - x * b * b.transpose() * x + q).norm(), 1e-9 * x.norm());
}

TEST(LqrTest, RefusesWhatCannotBeStabilised) {
  MatrixXd a(2, 2), b(2, 1);
  a << 1, 0, 0, -1;
  b << 0, 1;  // the unstable mode is out of reach
  const auto out_of_reach = Lqr(a, b, MatrixXd::Identity(2, 2), MatrixXd::Identity(1, 1));
  ASSERT_FALSE(out_of_reach.ok());
  EXPECT_EQ(out_of_reach.error().what, "no stabilising feedback exists");
  const auto negative = Lqr(a, b, MatrixXd::Identity(2, 2), -MatrixXd::Identity(1, 1));
  ASSERT_FALSE(negative.ok());
  EXPECT_EQ(negative.error().what, "the weights are not positive");
}

TEST(PlacePolesTest, PutsThemWhereAsked) {
  MatrixXd a = MatrixXd::Random(4, 4) * 20, b = MatrixXd::Random(4, 1);
  const std::vector<Complex> poles = {{-2, 0}, {-15, 0}, {-4, 3}, {-4, -3}};
  const auto k = PlacePoles(a, b, poles);
  ASSERT_TRUE(k.ok()) << k.error().Text();
  EXPECT_NEAR(k.value().poles[0].real(), -2, 1e-6);
  EXPECT_NEAR(k.value().poles[1].imag(), -3, 1e-6);
  EXPECT_NEAR(k.value().poles[3].real(), -15, 1e-6);
  // x'' = u: K = [w^2, 2 z w].
  MatrixXd a2(2, 2), b2(2, 1);
  a2 << 0, 1, 0, 0;
  b2 << 0, 1;
  const auto two = PlacePoles(a2, b2, {{-3, 4}, {-3, -4}});
  ASSERT_TRUE(two.ok());
  EXPECT_NEAR(two.value().gain(0, 0), 25, 1e-9);
  EXPECT_NEAR(two.value().gain(0, 1), 6, 1e-9);
  const auto alone = PlacePoles(a2, b2, {{-3, 4}, {-3, 4}});
  ASSERT_FALSE(alone.ok());
  EXPECT_EQ(alone.error().what, "complex poles come in pairs");
  EXPECT_FALSE(PlacePoles(a2, b2, {{-3, 0}}).ok());
  MatrixXd unreachable(2, 1);
  unreachable << 1, 0;
  EXPECT_FALSE(PlacePoles(a2, unreachable, {{-1, 0}, {-2, 0}}).ok());
}

// Constant speed seen through a noisy position: the Kalman-Bucy gain of the double integrator is [sqrt(2) (w/v)^(1/4),
// sqrt(w/v)].
TEST(ObserverTest, DualsOfTheFeedbacks) {
  MatrixXd a(2, 2), c(1, 2), w = MatrixXd::Zero(2, 2), v(1, 1);
  a << 0, 1, 0, 0;
  c << 1, 0;
  w(1, 1) = 16, v(0, 0) = 1;
  const auto kalman = KalmanGain(a, c, w, v);
  ASSERT_TRUE(kalman.ok());
  EXPECT_NEAR(kalman.value().gain(0, 0), std::sqrt(2.0) * 2, 1e-9);
  EXPECT_NEAR(kalman.value().gain(1, 0), 4, 1e-9);
  const auto luenberger = ObserverGain(a, c, {{-10, 0}, {-20, 0}});
  ASSERT_TRUE(luenberger.ok());
  EXPECT_NEAR(luenberger.value().gain(0, 0), 30, 1e-9);
  EXPECT_NEAR(luenberger.value().gain(1, 0), 200, 1e-9);
}

// The Qube's equations by hand, hanging and upright.
TEST(LinearizeTest, QubeIsItsTextbookMatrices) {
  const auto experiment = LoadExperiment(std::string(GAPSCOPE_SOURCE_DIR) + "/models/qube/experiment.yaml");
  ASSERT_TRUE(experiment.ok());
  const auto model = Model::Load(experiment.value());
  ASSERT_TRUE(model.ok()) << model.error().Text();
  const double mp = 0.024, l = 0.0645, L = 0.085, J = mp * 4 * l * l / 3, I = 4.6e-6 + 0.095 * L * L / 3 + mp * L * L,
               kt = 0.042, R = 8.4, ba = 1.5e-4 + kt * kt / R, bp = 3e-5, g = 9.81;
  for (const double up : {1.0, -1.0}) {  // hanging, upright
    const auto system = Linearize(
        *model.value(), model.value()->Nominal(), {},
        up > 0 ? std::map<std::string, double>{} : std::map<std::string, double>{{"pendulum", std::numbers::pi}}, 0);
    ASSERT_TRUE(system.ok()) << system.error().Text();
    Eigen::Matrix2d mass, right_q, right_v;
    mass << I, up * mp * L * l, up * mp * L * l, J;
    right_q << 0, 0, 0, -up * mp * g * l;
    right_v << -ba, 0, 0, -bp;
    const Eigen::Matrix2d inverse = mass.inverse();
    const double kScale = (inverse * right_q).cwiseAbs().maxCoeff();
    EXPECT_LT((system.value().a.block(2, 0, 2, 2) - inverse * right_q).cwiseAbs().maxCoeff(), 1e-5 * kScale);
    EXPECT_LT((system.value().a.block(2, 2, 2, 2) - inverse * right_v).cwiseAbs().maxCoeff(), 1e-5 * kScale);
    EXPECT_LT((system.value().b.bottomRows(2) - inverse * Eigen::Vector2d(kt / R, 0)).cwiseAbs().maxCoeff(),
              1e-5 * kScale);
  }
  EXPECT_FALSE(Linearize(*model.value(), model.value()->Nominal(), {}, {{"pendulum", 1.0}}, 0).ok());
  EXPECT_FALSE(Linearize(*model.value(), model.value()->Nominal(), {}, {{"pendulm", 0.0}}, 0).ok());
}

}  // namespace
}  // namespace gapscope
