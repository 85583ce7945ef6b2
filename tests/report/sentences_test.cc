// What a diagnosis states, a sentence each.
#include "src/report/sentences.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gapscope {
namespace {

const EffectUse kCable{"cable_spring", "arm"}, kGravity{"gravity_offset", "arm"}, kFriction{"load_friction", "arm"},
    kDelay{"command_delay", "motor"};

// As a Qube's chirps give it: a group, and two that are there both or neither.
Diagnosis Made() {
  Diagnosis d;
  d.effects.resize(1);
  d.nominal = 0.15194, d.refit = 0.0507, d.final = 0.01317, d.floor = 0.00291, d.closed = 0.79;
  d.evidence.free_run_before = 0.267, d.evidence.free_run_left = 0.063, d.evidence.free_run_removed = 0.764;
  const auto add = [&](const EffectUse& use, double probability, double share, int group) -> Statement& {
    d.statements.push_back({.use = use,
                            .answer = probability >= 0.5 ? Answer::kPresent : Answer::kAbsent,
                            .probability = probability,
                            .share_of_gap = {.value = share},
                            .group = group});
    return d.statements.back();
  };
  add(kDelay, 0.68, 0.02, -1).beside = kFriction;
  d.statements.back().parameters = {{"delay_s", "s", 0.0057312, 0.0045, 0.0069}};
  add(kCable, 0.85, 0.95, 0).parameters = {{"stiffness_n_m_per_rad", "N m/rad", 0.0012, 0.0003, 0.0047}};
  add(kGravity, 0.85, 0.95, 0);
  add({"backlash", "arm"}, 0.2, 0, -1);
  return d;
}

TEST(SentencesTest, OneForEachFindingTheLargestShareFirst) {
  const auto sentences = SentencesOf(Made());
  ASSERT_EQ(sentences.size(), 2u) << "what is absent has none, a group one";
  EXPECT_EQ(
      sentences[0].Text(),
      "cable spring or gravity offset on arm, cable spring 0.0012 (0.0003 .. 0.0047) N m/rad, 95 % of what closes, "
      "P 0.85; what would tell: slow sweep of the range; tilt the rig");
  EXPECT_EQ(
      sentences[1].Text(),
      "command delay on motor, 5.73 (4.5 .. 6.9) ms, 2 % of what closes, P 0.68, seen only beside load friction on "
      "arm");
}

TEST(SentencesTest, WhatTheClocksLeaveOpenIsToldWithIt) {
  Diagnosis d = Made();
  d.statements[0].caveat = "includes transport";
  EXPECT_TRUE(SentencesOf(d)[1].Text().ends_with("P 0.68, includes transport; seen only beside load friction on arm"));
}

TEST(SentencesTest, PlacesThatDifferAreEachNamed) {
  Diagnosis d = Made();
  d.statements[2].use.on = "pendulum";
  EXPECT_EQ(SentencesOf(d)[0].what, "cable spring on arm or gravity offset on pendulum");
}

TEST(SentencesTest, TheGapInWindowsAndInFreeRuns) {
  Diagnosis d = Made();
  EXPECT_EQ(GapInWindows(d),
            "in windows: nominal 0.152 -> retuned 0.0507 -> with what was found 0.0132, the sensors' floor 0.00291; 79 "
            "% closed");
  EXPECT_EQ(GapInFreeRuns(d), "over whole logs in one run: retuned 0.267 -> with what was found 0.063; 76 % closed");
  d.evidence.free_run_before = 36.5, d.evidence.free_run_left = 37.2;  // an unstable plant
  EXPECT_EQ(GapInFreeRuns(d),
            "over whole logs in one run: the motion is lost, errors 36.5 and 37.2: that shows nothing");
  d.evidence.free_run_left = INFINITY;
  EXPECT_EQ(GapInFreeRuns(d), "");
}

TEST(SentencesTest, LogsThatDifferAreARange) {
  Diagnosis d = Made();
  d.by_log = {{"a.csv", 0.2, 0.05, 0}};
  EXPECT_EQ(GapByLog(d), "");
  d.by_log = {{"a.csv", 0.2, 0.05, 0.04}, {"b.csv", 0.1, 0.11, 0}, {"c.csv", INFINITY, 0.1, 0}, {"d.csv", 0.4, 0.2, 0}};
  EXPECT_EQ(GapByLog(d), "each of 3 logs or parts of a log, left out of the fit: 0 .. 94 % closed, the median 50 %");
  d.by_log.push_back({"e.csv", 0.4, INFINITY, 0});  // where the final model cannot be simulated nothing closes
  EXPECT_EQ(GapByLog(d), "each of 4 logs or parts of a log, left out of the fit: 0 .. 94 % closed, the median 25 %");
  d.effects.clear();
  EXPECT_EQ(GapByLog(d), "");
}

TEST(SentencesTest, WhatIsNotKnownOfTheRemainderIsLeftOut) {
  const auto parts = PartsOf({.explained = 0.9, .systematic = 0.06, .sensors = 0.04, .not_repeatable = NAN});
  ASSERT_EQ(parts.size(), 3u);
  EXPECT_EQ(parts[2].name, "sensors");
}

TEST(NextSentencesTest, ARepeatIsAskedForWhereMuchIsLeftAndNoLogIsOne) {
  Diagnosis d;
  d.evidence.floors_left = 20;
  d.remainder.not_repeatable = kNaN;
  ASSERT_EQ(NextSentences(d).size(), 1u);
  EXPECT_NE(NextSentences(d)[0].find("Send those of one log again"), std::string::npos);
  d.remainder.not_repeatable = 0.1;
  EXPECT_TRUE(NextSentences(d).empty()) << "two logs have the same commands";
  d.remainder.not_repeatable = kNaN;
  d.evidence.floors_left = 1;
  EXPECT_TRUE(NextSentences(d).empty()) << "nothing is left";
}

}  // namespace
}  // namespace gapscope
