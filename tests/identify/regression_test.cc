#include "src/identify/regression.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace gapscope {
namespace {

// y = 2 x + 0.5 with an error of 0.3 s correlation time on a slow x: the plain formula's interval would hold the truth
// in less than half of the cases.
TEST(RegressionTest, IntervalsHoldTheTruthUnderCorrelatedErrors) {
  constexpr int kRuns = 300;
  constexpr double kDt = 0.01;
  int held = 0, plain_held = 0;
  for (int run = 0; run < kRuns; ++run) {
    std::mt19937_64 random(static_cast<unsigned>(run));
    std::normal_distribution<double> normal;
    Rows rows({"x", "constant"});
    const double rho = std::exp(-kDt / 0.3);
    double e = normal(random), phase = 6.28 * run / kRuns;
    for (int k = 0; k < 6000; ++k) {
      const double t = kDt * k, x = std::sin(0.9 * t + phase) + 0.5 * std::sin(2.3 * t);
      rows.Add(0, t, 2 * x + 0.5 + 0.2 * e, {x, 1});
      e = rho * e + std::sqrt(1 - rho * rho) * normal(random);
    }
    const auto fit = Regress(rows, kDt);
    ASSERT_TRUE(fit.ok());
    const Regression& f = fit.value();
    held += f.low[0] <= 2 && 2 <= f.high[0] ? 1 : 0;
    const Eigen::MatrixXd x = rows.X();
    const double plain = 1.96 * f.rmse * std::sqrt((x.transpose() * x).inverse()(0, 0));
    plain_held += std::abs(f.value[0] - 2) <= plain ? 1 : 0;
  }
  // 95 % of 300 are 285; two standard deviations of the count are 7.5. Blocks make it a little less than 95 %.
  EXPECT_GE(held, 270);
  EXPECT_LE(held, 299);
  EXPECT_LT(plain_held, 180);
}

TEST(RegressionTest, SaysWhichColumnsCannotBeToldApart) {
  Rows rows({"angle", "speed", "twice the angle"});
  for (int k = 0; k < 100; ++k)
    rows.Add(0, 0.01 * k, std::sin(0.3 * k), {std::cos(0.1 * k), std::sin(0.1 * k), 2 * std::cos(0.1 * k)});
  const auto fit = Regress(rows, 0.01);
  ASSERT_FALSE(fit.ok());
  EXPECT_NE(fit.error().what.find("'angle', 'twice the angle'"), std::string::npos) << fit.error().what;
  Rows still({"angle", "speed"});
  for (int k = 0; k < 100; ++k) still.Add(0, 0.01 * k, 1, {std::cos(0.1 * k), 0});
  ASSERT_FALSE(Regress(still, 0.01).ok());
  EXPECT_NE(Regress(still, 0.01).error().what.find("'speed'"), std::string::npos);
  Rows few({"angle"});
  for (int k = 0; k < 10; ++k) few.Add(0, 0.01 * k, 1, {1});
  EXPECT_FALSE(Regress(few, 0.01).ok());
}

}  // namespace
}  // namespace gapscope
