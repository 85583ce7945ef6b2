// Moments, medians and quantiles against values counted by hand, Student's t against printed tables.
#include "src/core/statistics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gapscope {
namespace {

TEST(StatisticsTest, MomentsAreOfTheFiniteValues) {
  const Moments four = MomentsOf(std::vector{1.0, kNaN, 3.0, 5.0, kInfinity, 7.0});
  EXPECT_EQ(four.mean, 4);
  EXPECT_DOUBLE_EQ(four.deviation, std::sqrt(5)) << "(9 + 1 + 1 + 9) / 4";
  EXPECT_EQ(MomentsOf(std::vector(3, 0.1)).deviation, 0) << "though 0.1 + 0.1 + 0.1 is not 0.3";
  EXPECT_TRUE(std::isnan(MomentsOf(std::vector{kNaN}).mean));
  EXPECT_TRUE(std::isnan(MomentsOf(std::vector{kNaN}).deviation));
}

TEST(StatisticsTest, QuantilesAreOfTheNearestRank) {
  EXPECT_EQ(Median({3, 1, 2}), 2);
  EXPECT_EQ(Median({4, 1, 2, 3}), 3) << "of an even number the upper one";
  EXPECT_EQ(Quantile({5, 1, 4, 2, 3}, 0), 1);
  EXPECT_EQ(Quantile({5, 1, 4, 2, 3}, 0.3), 2) << "rank 1.2";
  EXPECT_EQ(Quantile({5, 1, 4, 2, 3}, 0.4), 3) << "rank 1.6";
  EXPECT_EQ(Quantile({5, 1, 4, 2, 3}, 1), 5);
  EXPECT_TRUE(std::isnan(Median({})));
}

TEST(StatisticsTest, StudentQuantilesAreThoseOfTheTables) {
  // Two-sided 95 %: 4.303, 2.776, 2.228, 2.042, 1.960.
  for (const auto& [n, t] : {std::pair{2.0, 4.303}, {4.0, 2.776}, {10.0, 2.228}, {30.0, 2.042}, {1e6, 1.960}})
    EXPECT_NEAR(StudentQuantile(n), t, 0.01 * t) << n;
}

TEST(StatisticsTest, StudentTailsAreThoseOfTheTables) {
  // Two-sided 95 %, and 99 % at the end.
  for (const auto& [n, t] : {std::pair{1u, 12.706}, {2u, 4.303}, {5u, 2.571}, {10u, 2.228}, {1000u, 1.962}})
    EXPECT_NEAR(StudentTails(t, n), 0.05, 1e-4) << n;
  EXPECT_NEAR(StudentTails(-3.169, 10), 0.01, 1e-5);
}

// Of a mean, the jackknife's variance is the textbook's: s^2 / (n - 1) of estimates that each lack one of n numbers.
TEST(StatisticsTest, JackknifeOfAMeanIsItsStandardError) {
  const std::vector<double> numbers = {1.0, 2.5, 4.0, 3.0, 7.5};
  std::vector<double> without;
  for (const double left_out : numbers) without.push_back((18.0 - left_out) / 4);
  // Deviations from the mean 3.6: squares add up to 23.7, so that s^2 = 5.925.
  EXPECT_NEAR(JackknifeHalf(without), StudentQuantile(4) * std::sqrt(5.925 / 4), 1e-12);
  EXPECT_EQ(JackknifeHalf(std::vector<double>{1, 2}), 0);
}

}  // namespace
}  // namespace gapscope
