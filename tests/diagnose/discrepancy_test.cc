// Evidence of an effect beside random torques, on columns made by hand.
#include "src/diagnose/discrepancy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace gapscope {
namespace {

constexpr Eigen::Index kTorques = 12, kRows = 400;

// Columns: an effect, twelve torques, the residual.
struct TorqueBank {
  Eigen::MatrixXd rows;
  ColumnTable table;
  TorqueBank() {
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    rows = Eigen::MatrixXd::NullaryExpr(kRows, kTorques + 2, [&] { return normal(random); });
    for (int i = 0; i < kTorques; ++i) table.torques.push_back(1 + i);
  }
  ColumnTable Of(const Eigen::MatrixXd& columns) const {
    ColumnTable made = table;
    made.reduced = columns.transpose() * columns;
    made.gram.half_seconds = 50;
    return made;
  }
  // Of the fit with the effect over that without it: what is left beside its column, and all.
  double Evidence() const {
    const Eigen::VectorXd e = rows.col(0).normalized();
    const Eigen::MatrixXd beside = rows - e * (e.transpose() * rows);
    return TorquesBeside(Of(beside), kRows).likelihood - TorquesBeside(Of(rows), kRows).likelihood;
  }
};

TEST(DiscrepancyTest, AnEffectThatNoTorqueHoldsCounts) {
  TorqueBank bank;
  bank.rows.col(kTorques + 1) = -5 * bank.rows.col(0) + bank.rows.col(kTorques + 1);
  // 200 numbers that count; their square falls from 26 to 1: half of it times ln 26, less the torques' own share.
  EXPECT_NEAR(bank.Evidence(), 100 * std::log(26.0), 15);
}

// One torque of many that are there beside it: the others' size says that it may well be no effect.
TEST(DiscrepancyTest, AnEffectAmongTorquesOfItsSizeHardlyCounts) {
  TorqueBank bank;
  std::mt19937_64 random(8);
  std::normal_distribution<double> normal;
  for (Eigen::Index t = 1; t <= kTorques; ++t) bank.rows.col(kTorques + 1) += 5 * normal(random) * bank.rows.col(t);
  bank.rows.col(0) = bank.rows.col(1);
  EXPECT_LT(std::abs(bank.Evidence()), 12);
}

TEST(DiscrepancyTest, AnEffectThatIsNotThereCountsAgainst) {
  TorqueBank bank;
  EXPECT_NEAR(bank.Evidence(), 0, 2);
}

}  // namespace
}  // namespace gapscope
