#include "src/diagnose/evidence.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gapscope {
namespace {

Candidate WithBlocks(std::vector<double> train, std::vector<double> held_out) {
  Candidate c;
  c.train_blocks = std::move(train);
  c.held_out_blocks = std::move(held_out);
  c.block_floor = 1;
  return c;
}

TEST(EvidenceTest, HandNumbers) {
  const Candidate a = WithBlocks({3, 7}, {1, 3}), b = WithBlocks({1, 3}, {1, 1});
  const Evidence e = Compare(a, b);
  EXPECT_DOUBLE_EQ(e.gain, 2);
  EXPECT_DOUBLE_EQ(e.held_out, 0.5);
  EXPECT_DOUBLE_EQ(e.train, 0.6);
  // Ratios: 4/2, 8/4, 2/2, 4/2: three times log 2; their standard deviation over n - 1 is log 2 / 2, of the sum log 2.
  EXPECT_NEAR(e.log_ratio, 3 * std::log(2.0), 1e-12);
  EXPECT_NEAR(e.z, 3, 1e-12);
  EXPECT_NEAR(LogMisfit(a) - LogMisfit(b), e.log_ratio, 1e-12);
}

TEST(EvidenceTest, Antisymmetric) {
  const Candidate a = WithBlocks({3, 7, 2}, {1, 3}), b = WithBlocks({1, 8, 2}, {1, 1});
  EXPECT_DOUBLE_EQ(Compare(a, b).log_ratio, -Compare(b, a).log_ratio);
  EXPECT_DOUBLE_EQ(Compare(a, b).z, -Compare(b, a).z);
}

// Two blocks that both models miss by far must not drown what happens in all the others.
TEST(EvidenceTest, SharedMisfitDoesNotHideAGain) {
  std::vector<double> a(40, 2.0), b(40, 1.0);
  a[7] = b[7] = 5e4;
  a[8] = 4e4, b[8] = 4.1e4;
  // Of 80 ratios 76 are log(3/2), two are zero and two slightly against it: sums that far from chance count as ten.
  const Evidence all = Compare(WithBlocks(a, a), WithBlocks(b, b));
  EXPECT_NEAR(all.log_ratio, 76 * std::log(1.5) + 2 * std::log(40001.0 / 41001.0), 1e-9);
  EXPECT_DOUBLE_EQ(all.z, 10);
  // Ratios log(3/2), 0, log(3/2), 0: their sum is 2 log(3/2), its standard deviation sqrt(4/3) log(3/2).
  const Evidence few = Compare(WithBlocks({2, 5e4}, {2, 5e4}), WithBlocks({1, 5e4}, {1, 5e4}));
  EXPECT_NEAR(few.log_ratio, 2 * std::log(1.5), 1e-12);
  EXPECT_NEAR(few.z, std::sqrt(3.0), 1e-12);
}

TEST(EvidenceTest, ChanceIsNotConvincing) {
  std::vector<double> a, b;
  for (int i = 0; i < 60; ++i) {
    a.push_back(10 + 3 * std::sin(1.7 * i));
    b.push_back(9.7 + 3 * std::sin(2.9 * i));
  }
  EXPECT_FALSE(Convincing(Compare(WithBlocks(a, a), WithBlocks(b, b)), {.share = 0.01, .z = 2.5}));
}

// A limit that only a few blocks reach.
TEST(EvidenceTest, FewBlocksWithALargeShareConvince) {
  std::vector<double> a(30, 1.0), b(30, 1.0);
  a[3] = a[4] = a[5] = 400;
  EXPECT_TRUE(Convincing(Compare(WithBlocks(a, a), WithBlocks(b, b)), {.share = 0.01, .z = 2.5}));
}

// The same where the fitted logs hardly reach it; one block alone, however large, is chance.
TEST(EvidenceTest, FewHeldOutBlocksWithMostOfTheCostConvince) {
  std::vector<double> train_a(30, 1.0), train_b(30, 1.0), a(30, 1.0), b(30, 1.0);
  train_a[0] = 1.5;
  a[3] = a[4] = a[5] = 400;
  const Evidence e = Compare(WithBlocks(train_a, a), WithBlocks(train_b, b));
  EXPECT_LT(e.train, 0.05);
  EXPECT_LT(e.z, 2.5);
  EXPECT_TRUE(Convincing(e, {.share = 0.01, .z = 2.5}));
  a[4] = a[5] = 1;
  EXPECT_FALSE(Convincing(Compare(WithBlocks(train_a, a), WithBlocks(train_b, b)), {.share = 0.01, .z = 2.5}));
}

// A gain on the training logs that the held-out ones do not show is none.
TEST(EvidenceTest, HeldOutMustGainToo) {
  EXPECT_FALSE(Convincing(Compare(WithBlocks(std::vector<double>(30, 9.0), std::vector<double>(10, 2.0)),
                                  WithBlocks(std::vector<double>(30, 1.0), std::vector<double>(10, 2.1))),
                          {.share = 0.01, .z = 2.5}));
}

TEST(EvidenceTest, WhatCannotBeSimulatedLoses) {
  const Candidate a = WithBlocks({3, 7}, {1, 3}), broken = WithBlocks({1, 1}, {});
  EXPECT_LT(Compare(a, broken).z, 0);
  EXPECT_GT(Compare(broken, a).z, 0);
  EXPECT_TRUE(std::isinf(LogMisfit(broken)));
}

}  // namespace
}  // namespace gapscope
