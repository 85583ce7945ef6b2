// Evidence of an effect beside random torques, on columns made by hand.
#include "src/diagnose/discrepancy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace gapscope {
namespace {

constexpr Eigen::Index kTorques = 12, kRows = 400;

// Columns: an effect, twelve torques, the residual.
struct Bank {
  Eigen::MatrixXd rows;
  ColumnTable table;
  std::vector<RandomTorque> torques;
  Bank() {
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    rows = Eigen::MatrixXd::NullaryExpr(kRows, kTorques + 2, [&] { return normal(random); });
    for (int i = 0; i < kTorques; ++i) {
      torques.push_back({.of = static_cast<RandomTorque::Of>(3 * i / kTorques)});
      table.torques.push_back(1 + i);
    }
    table.trials.push_back({.use = {"effect", "joint"}, .columns = {0}});
  }
  void Finish() {
    table.reduced = rows.transpose() * rows;
    table.gram.blocks.resize(50);
  }
  double Evidence() const {
    return TorquesBeside(table, table.trials[0].columns, kRows).likelihood - TorquesBeside(table, {}, kRows).likelihood;
  }
};

TEST(DiscrepancyTest, AnEffectThatNoTorqueHoldsCounts) {
  Bank bank;
  bank.rows.col(kTorques + 1) = -5 * bank.rows.col(0) + bank.rows.col(kTorques + 1);
  bank.Finish();
  // 200 numbers that count; their square falls from 26 to 1: half of it times ln 26, less the torques' own share.
  EXPECT_NEAR(bank.Evidence(), 100 * std::log(26.0), 15);
  EXPECT_EQ(Mimicry(bank.table, bank.torques, 0.9), 0);
}

// One torque of many that are there beside it: the others' size says that it may well be no effect.
TEST(DiscrepancyTest, AnEffectAmongTorquesOfItsSizeHardlyCounts) {
  Bank bank;
  std::mt19937_64 random(8);
  std::normal_distribution<double> normal;
  for (Eigen::Index t = 1; t <= kTorques; ++t) bank.rows.col(kTorques + 1) += 5 * normal(random) * bank.rows.col(t);
  bank.rows.col(0) = bank.rows.col(1);
  bank.Finish();
  EXPECT_LT(std::abs(bank.Evidence()), 12);
}

TEST(DiscrepancyTest, AnEffectThatIsNotThereCountsAgainst) {
  Bank bank;
  bank.Finish();
  EXPECT_NEAR(bank.Evidence(), 0, 2);
}

// Sums of one torque hold it fully, with one of the two signs.
TEST(MimicryTest, ATorqueAsAnEffectIsHeldByItself) {
  Bank bank;
  bank.rows.middleCols(2, kTorques - 1).setZero();
  bank.rows.col(0) = bank.rows.col(1);
  bank.Finish();
  const double p = Mimicry(bank.table, bank.torques, 0.9);
  // A third of the sums are of its family; half of those have its sign.
  EXPECT_GT(p, 0.05);
  EXPECT_LT(p, 0.3);
}

}  // namespace
}  // namespace gapscope
