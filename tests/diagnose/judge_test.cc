// From numbers to statements and verdicts.
#include "src/diagnose/judge.h"

#include <gtest/gtest.h>

#include <cmath>

#include "src/core/statistics.h"
#include "src/diagnose/policy.h"
#include "src/diagnose/probability.h"

namespace gapscope {
namespace {

constexpr StatementNumbers kClear{
    .gain = 3, .gain_held_out = 3, .gain_free = 3, .discrepancy = 80, .clear = 4, .smooth = false};

TEST(ProbabilityTest, GrowsWithEachKindOfEvidence) {
  const double clear = ProbabilityOf(kClear);
  EXPECT_GT(clear, 0.9);
  StatementNumbers weaker = kClear;
  weaker.gain = weaker.gain_held_out = weaker.gain_free = 0;
  EXPECT_LT(ProbabilityOf(weaker), clear);
  weaker = kClear, weaker.discrepancy = -3;
  EXPECT_LT(ProbabilityOf(weaker), clear);
  weaker = kClear, weaker.clear = -1;
  EXPECT_LT(ProbabilityOf(weaker), clear);
  weaker = kClear, weaker.smooth = true;
  EXPECT_LT(ProbabilityOf(weaker), clear);
  StatementNumbers dry = weaker;
  dry.dry = true;
  EXPECT_GT(ProbabilityOf(dry), ProbabilityOf(weaker));
  EXPECT_LT(ProbabilityOf({}), 0.05);
}

// What a richer effect does beyond a simpler one: an open question is not answered by naming the simpler one.
TEST(ToldBeyondTest, AnOpenQuestionIsToldTogether) {
  EXPECT_EQ(ToldBeyond(0.19), Told::kSimpler);
  EXPECT_EQ(ToldBeyond(0.21), Told::kTogether);
  EXPECT_EQ(ToldBeyond(0.49), Told::kTogether);
  EXPECT_EQ(ToldBeyond(0.5), Told::kRicher);
}

// Logs that do not reach the effect, and windows too short for it to add up, do not speak against what others show.
TEST(ProbabilityTest, TheLargestGainCounts) {
  StatementNumbers numbers = kClear;
  numbers.gain = numbers.gain_held_out = 0.1;
  EXPECT_EQ(ProbabilityOf(numbers), ProbabilityOf(kClear));
}

// What a fit gains on its own logs alone is no evidence.
TEST(ProbabilityTest, WhatNothingUnseenConfirmsDoesNotCount) {
  StatementNumbers numbers = kClear;
  numbers.gain = 6, numbers.gain_held_out = -3, numbers.gain_free = kNaN;
  EXPECT_TRUE(IsUnconfirmed(numbers));
  EXPECT_EQ(LargestGain(numbers), -3);
  EXPECT_LT(ProbabilityOf(numbers), kDiagnosePolicy.probability.present);
  numbers.gain_free = 0.5;
  EXPECT_FALSE(IsUnconfirmed(numbers));
  EXPECT_EQ(LargestGain(numbers), 6);
}

// Free runs that lose the motion either way tell nothing.
TEST(ProbabilityTest, WhatTellsNothingIsLeftOut) {
  StatementNumbers numbers = kClear;
  numbers.gain_free = kNaN;
  EXPECT_EQ(ProbabilityOf(numbers), ProbabilityOf(kClear));
}

TEST(OneFindingTest, TwoThatGainAlikeOrOnlyTogether) {
  EXPECT_TRUE(AreOneFinding(2.4, 1.4, 2.5));
  EXPECT_TRUE(AreOneFinding(0.3, 0.05, 2.5));  // each does the other's work
  EXPECT_FALSE(AreOneFinding(2.4, 0.3, 2.5));  // one carries both
  EXPECT_FALSE(AreOneFinding(2.4, -0.1, 2.3));
}

Statement Member(double probability, StatementNumbers numbers) {
  return {.probability = probability, .numbers = numbers};
}

// The one held-out log of a late drive may not show it: what is far less likely goes before.
TEST(SpareTest, TheLeastLikelyGoesFirst) {
  const StatementNumbers clear = kClear,
                         late{.gain = 0.3, .gain_held_out = -0.04, .gain_free = 0.4, .discrepancy = 70, .clear = -0.6},
                         drag{.gain = 0.02, .gain_held_out = -0.02, .gain_free = 0.05, .discrepancy = 8, .clear = -0.6};
  std::vector<Statement> members = {Member(0.97, clear), Member(0.4, late), Member(0.02, drag)};
  EXPECT_EQ(LeastLikelySpare(members) - members.begin(), 2);
  members.pop_back();
  EXPECT_EQ(LeastLikelySpare(members) - members.begin(), 1);
  members.pop_back();
  EXPECT_EQ(LeastLikelySpare(members), members.end());
}

// Not sure, but it gains on every log: it may say what others need it for.
TEST(SpareTest, WhatGainsEverywhereStays) {
  std::vector<Statement> members = {
      Member(0.3, {.gain = 0.3, .gain_held_out = 0.2, .gain_free = 0.1, .discrepancy = 2, .clear = 1})};
  EXPECT_EQ(LeastLikelySpare(members), members.end());
  members.front().numbers.gain = 0.05;
  EXPECT_EQ(LeastLikelySpare(members), members.begin());
}

// However sure: it gains on the logs that were fitted alone.
TEST(SpareTest, WhatNothingUnseenConfirmsIsSpare) {
  std::vector<Statement> members = {Member(0.9, {.gain = 6, .gain_held_out = -1, .gain_free = -0.2, .clear = -1})};
  EXPECT_EQ(LeastLikelySpare(members), members.begin());
}

// Costs 1 with both, 1.3 without either one, 1.4 without both: one alone brings 0.1 of the 0.3 that it brings beside
// the other. Distinct effects: what they gain adds up, however large it is.
TEST(ComplementsTest, TwoThatAreSeenOnlyBesideEachOther) {
  EXPECT_TRUE(AreComplements(std::log(1.3), std::log(1.3), std::log(1.4)));
  EXPECT_FALSE(AreComplements(std::log(1.3), std::log(1.3), std::log(1.6)));
  EXPECT_FALSE(AreComplements(std::log(11), std::log(11), std::log(21)));
  EXPECT_FALSE(AreComplements(std::log(11), std::log(1.1), std::log(11)));  // one is seen alone
  EXPECT_FALSE(AreComplements(std::log(1.3), -0.1, std::log(1.3)));
}

// Squared errors on held-out logs: 1 with both, 16 and 9 without either one, 2.6 without both. One alone does harm.
TEST(ComplementsTest, OneAloneDoesHarmOnLogsThatAreHeldOut) {
  const StatementNumbers a{.gain = std::log(5), .gain_held_out = std::log(16)},
      b{.gain = std::log(6), .gain_held_out = std::log(9)};
  StatementNumbers both{.gain = std::log(12), .gain_held_out = std::log(2.6)};
  EXPECT_TRUE(AreComplements(a, b, both));
  both.gain_held_out = std::log(26);
  EXPECT_FALSE(AreComplements(a, b, both));
}

// Odds multiply: 1 to 3 at nine to one are 3 to 1.
TEST(PriorTest, MultipliesTheOdds) {
  EXPECT_DOUBLE_EQ(AtPrior(0.25, 0.9), 0.75);
  EXPECT_DOUBLE_EQ(AtPrior(0.25, 0.5), 0.25);
  EXPECT_EQ(AtPrior(0.99, 0), 0);
  EXPECT_EQ(AtPrior(0.01, 1), 1);
}

TEST(VerdictTest, FollowsFromWhatIsThereAndWhatIsLeft) {
  EXPECT_EQ(VerdictOf({.present = true, .told = true, .floors_left = 30}), Verdict::kEffects);
  EXPECT_EQ(VerdictOf({.present = true, .told = false, .floors_left = 1}), Verdict::kAmbiguous);
  EXPECT_EQ(VerdictOf({.present = false, .floors_left = 30}), Verdict::kUnknown);
  EXPECT_EQ(VerdictOf({.present = false, .floors_left = 1, .retuned = 0.5}), Verdict::kParameters);
  EXPECT_EQ(VerdictOf({.present = false, .floors_left = 1, .retuned = 0}), Verdict::kNone);
}

}  // namespace
}  // namespace gapscope
