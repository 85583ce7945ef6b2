// What a further log is foretold to do to a probability.
#include "src/diagnose/next_experiment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "src/core/statistics.h"
#include "src/diagnose/probability.h"

namespace gapscope {
namespace {

// An effect that gains a third in 30 s of logs, and as much of it beside random torques.
OpenQuestion Unsure() {
  return {.numbers = {.gain = 0.3, .gain_held_out = 0.2, .gain_free = kNaN, .discrepancy = 12, .clear = 1},
          .nested = true,
          .seconds = 30};
}

TEST(ForetellTest, ALogThatTellsNothingChangesNothing) {
  const OpenQuestion question = Unsure();
  const Foretold same = Foretell(question, {});
  EXPECT_NEAR(same.if_present, ProbabilityOf(question.numbers), 1e-12);
  EXPECT_NEAR(same.if_absent, same.if_present, 1e-12);
}

TEST(ForetellTest, TheMoreItTellsTheFurtherTheAnswersLieApart) {
  const OpenQuestion question = Unsure();
  Foretold before = Foretell(question, {.seconds = 8});
  for (const double there : {0.1, 1.0, 10.0}) {
    const Foretold after = Foretell(question, {.seconds = 8, .there = there});
    EXPECT_GT(after.if_present, before.if_present);
    EXPECT_LT(after.if_absent, before.if_absent);
    before = after;
  }
  EXPECT_GT(before.if_present, 0.7);
  EXPECT_LT(before.if_absent, 0.1);
}

// Residuals of one line a second, r = effect * size in the old logs and nothing in the new one, the size that costs
// least found by trying: what is gained over size zero.
TEST(ForetellTest, WhereItIsNotThereTheSizeSuitsBothLogs) {
  OpenQuestion question{.numbers = {.gain = 0.4, .gain_held_out = kNaN, .gain_free = kNaN}, .nested = true};
  question.seconds = 20;
  const double seconds = 8, there = 0.7, known = question.seconds * std::expm1(0.4);
  const auto cost = [&](double size) {
    return question.seconds + seconds + known * (1 - size) * (1 - size) + seconds * there * size * size;
  };
  double least = kInfinity;
  for (double size = 0; size <= 1; size += 1e-5) least = std::min(least, cost(size));
  const StatementNumbers numbers{
      .gain = std::log(cost(0) / least), .gain_held_out = kNaN, .gain_free = kNaN, .discrepancy = 0, .clear = 0};
  EXPECT_NEAR(Foretell(question, {.seconds = seconds, .there = there}).if_absent, ProbabilityOf(numbers), 1e-6);
}

// Two that stand in for each other: what ties is told together, what costs more is not told.
TEST(ForetellTest, ARivalThatDoesWorseSpeaksForTheOther) {
  OpenQuestion question{.together = 0.8, .behind = 0.01, .tie = 0.1};
  question.next.probability = 0.4;
  question.seconds = 20;
  const Foretold alike = Foretell(question, {.seconds = 8, .there = 0.01, .not_there = 0.01});
  const Foretold apart = Foretell(question, {.seconds = 8, .there = 20, .not_there = 20});
  EXPECT_EQ(alike.if_present, 0.4) << "no log tells them";
  EXPECT_EQ(alike.if_absent, 0.4);
  EXPECT_EQ(apart.if_present, 0.8);
  EXPECT_EQ(apart.if_absent, 0);
  // Lines of equal weight: the cost of the second one is (20 + 8 * 2) / 28 of the first one's, beyond twice the tie.
  EXPECT_EQ(Foretell(question, {.seconds = 8, .there = 1, .not_there = 0}).if_present, 0.8);
  EXPECT_EQ(Foretell(question, {.seconds = 8, .there = 0.7, .not_there = 0}).if_present, 0.4);
  EXPECT_EQ(Foretell(question, {.seconds = 8, .there = 1, .not_there = 0}).if_absent, 0.4);
}

TEST(IsWorthALogTest, WhereTheAnswersLieApart) {
  EXPECT_TRUE(IsWorthALog(Unsure(), {.if_present = 0.78, .if_absent = 0.2}));
  EXPECT_FALSE(IsWorthALog(Unsure(), {.if_present = 0.56, .if_absent = 0.47}))
      << "0.5 lies between, and nothing is told";
  EXPECT_FALSE(IsWorthALog(Unsure(), {.if_present = 0.3, .if_absent = 0.1}));
  OpenQuestion between{.together = 0.7};
  between.next.probability = 0.35;
  EXPECT_TRUE(IsWorthALog(between, {.if_present = 0.7, .if_absent = 0.35})) << "one is told alone where it is there";
  EXPECT_FALSE(IsWorthALog(between, {.if_present = 0.35, .if_absent = 0.35}));
}

TEST(DesignNextTest, WhatNoInputTellsIsSaidWithoutOne) {
  ThreadPool pool(1);
  const ScaleTable scales;
  const Workbench bench{.rig = nullptr, .data = nullptr, .scales = scales, .pool = pool};
  std::vector<OpenQuestion> questions(2);
  questions[0].next = {.why = NextExperiment::Why::kTogether, .problem = "they are one motion"};
  questions[1].next = {.why = NextExperiment::Why::kUnseen, .problem = "another problem"};
  std::size_t asked = 0;
  const NextExperiment next = DesignNext(
      [&]() -> std::optional<OpenQuestion> {
        if (asked == questions.size()) return std::nullopt;
        return questions[asked++];
      },
      bench, {});
  EXPECT_EQ(asked, questions.size()) << "a later question may have an input";
  EXPECT_EQ(next.why, NextExperiment::Why::kTogether);
  EXPECT_EQ(next.problem, "they are one motion");
  EXPECT_TRUE(next.input_csv.empty());
}

TEST(IsForAnInputTest, WhatTheLogsDoNotMoveButNotWhatWasNotTried) {
  EXPECT_TRUE(IsForAnInput({.answer = Answer::kUnseen, .rule = "these logs do not move what it acts on"}));
  EXPECT_FALSE(IsForAnInput({.answer = Answer::kUnseen, .rule = kNotTried}));
  EXPECT_FALSE(IsForAnInput({.answer = Answer::kUnseen, .rule = kOutOfSight}));
  EXPECT_FALSE(IsForAnInput({.answer = Answer::kAbsent, .rule = "gains too little"}));
}

}  // namespace
}  // namespace gapscope
