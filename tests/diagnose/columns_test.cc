// Sets of effects by arithmetic, on columns made by hand.
#include "src/diagnose/columns.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace gapscope {
namespace {

// Four effects of two trials each over 60 residuals; the residual is what effects 1 and 3 make, and noise.
struct Bank {
  Eigen::MatrixXd rows{60, 9};
  ColumnTable table;
  Bank() {
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    rows = Eigen::MatrixXd::NullaryExpr(60, 9, [&] { return normal(random); });
    rows.col(8) = -(0.8 * rows.col(2) + 0.5 * rows.col(7)) + 0.1 * rows.col(8);
    for (std::size_t t = 0; t < 8; ++t) {
      table.trials.push_back({.use = {"effect" + std::to_string(t / 2), "joint"},
                              .effect = t / 2,
                              .columns = {static_cast<Eigen::Index>(t)}});
    }
    table.sum = table.reduced = rows.transpose() * rows;
    table.bounds = {.low = Eigen::VectorXd::Zero(8),
                    .high = Eigen::VectorXd::Constant(8, 2.5),
                    .prior_weight = Eigen::VectorXd::Zero(8),
                    .prior_gone = Eigen::VectorXd::Zero(8)};
    table.cost = 0.5 * table.reduced(8, 8);
  }
  // Half the squares that are left, coefficients inside 0 .. 2.5, by trying which of the two are at zero.
  double Cost(std::size_t a, std::size_t b) const {
    const Eigen::VectorXd r = rows.col(8), x = rows.col(static_cast<Eigen::Index>(a)),
                          y = rows.col(static_cast<Eigen::Index>(b));
    const auto alone = [&](const Eigen::VectorXd& c) {
      return 0.5 * (r + std::clamp(-c.dot(r) / c.squaredNorm(), 0.0, 2.5) * c).squaredNorm();
    };
    double least = std::min({0.5 * r.squaredNorm(), alone(x), alone(y)});
    const double xx = x.dot(x), yy = y.dot(y), xy = x.dot(y), det = xx * yy - xy * xy;
    const double p = (-x.dot(r) * yy + y.dot(r) * xy) / det, q = (-y.dot(r) * xx + x.dot(r) * xy) / det;
    if (p >= 0 && q >= 0 && p <= 2.5 && q <= 2.5) least = std::min(least, 0.5 * (r + p * x + q * y).squaredNorm());
    return least;
  }
};

TEST(BeamSearchTest, FindsTheBestPairOfAll) {
  const Bank bank;
  const auto levels = BeamSearch(bank.table, 2, 8);
  ASSERT_EQ(levels.size(), 2u);
  double least = 1e300;
  for (std::size_t a = 0; a < 8; ++a) {
    for (std::size_t b = a + 1; b < 8; ++b) {
      if (a / 2 != b / 2) least = std::min(least, bank.Cost(a, b));
    }
  }
  EXPECT_NEAR(levels[1].front().cost, least, 1e-9 * least);
  std::vector<std::size_t> trials = levels[1].front().trials;
  std::sort(trials.begin(), trials.end());
  EXPECT_EQ(trials, (std::vector<std::size_t>{2, 7}));
  // One entry for each effect, and for each pair of effects.
  EXPECT_EQ(levels[0].size(), 4u);
  EXPECT_EQ(levels[1].size(), 6u);
}

TEST(ImitatedTest, IsTheSquaredCosine) {
  const Bank bank;
  const Eigen::VectorXd a = bank.rows.col(0), b = bank.rows.col(5);
  const double cosine = a.dot(b) / (a.norm() * b.norm());
  EXPECT_NEAR(Imitated(bank.table, bank.table.trials[0], bank.table.trials[5]), cosine * cosine, 1e-9);
  EXPECT_NEAR(Imitated(bank.table, bank.table.trials[0], bank.table.trials[0]), 1, 1e-6);
}

}  // namespace
}  // namespace gapscope
