// What a diagnosis says to people and to programs.
#include "src/report/diagnose_report.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "src/diagnose/explain.h"

namespace gapscope {
namespace {

// A cable spring is found, and much more is missing where the arm is fast.
Diagnosis Unfinished() {
  Diagnosis d;
  d.verdict = Verdict::kEffects;
  d.nominal = 0.4, d.refit = 0.3, d.final = 0.2;
  d.evidence.floors_before = 8.2, d.evidence.floors_left = 5.1;
  d.effects.push_back({.use = {"cable_spring", "arm"},
                       .probability = 0.4,
                       .parameters = {},
                       .error_before = 0.3,
                       .error_after = 0.2,
                       .share_of_gap = 1});
  d.where.push_back(
      {.signal = "arm_rad", .condition = "angle 0.4..0.8 rad", .share_of_error = 0.7, .share_of_time = 0.2});
  d.remains.push_back(
      {.signal = "arm_rad", .condition = "speed 4..9 rad/s", .share_of_error = 0.6, .share_of_time = 0.1});
  d.explanation = Explain(d);
  return d;
}

TEST(DiagnoseReportTest, SaysWhatWasFoundAndWhereTheRestLies) {
  const Diagnosis d = Unfinished();
  EXPECT_NE(d.explanation.find("cable_spring@arm explains 100 % of the gap that closes"), std::string::npos)
      << d.explanation;
  const std::string page = ToTable(DiagnoseRun{.info = {}, .diagnosis = d});
  EXPECT_LT(page.find("angle 0.4..0.8 rad"), page.find("\nwhat remains"));
  EXPECT_LT(page.find("\nwhat remains"), page.rfind("speed 4..9 rad/s"));
}

TEST(DiagnoseReportTest, UnknownSaysWhereTheGapLies) {
  Diagnosis d = Unfinished();
  d.verdict = Verdict::kUnknown;
  d.effects.clear();
  d.remains = d.where;
  const std::string text = Explain(d);
  EXPECT_NE(text.find("No known effect explains what remains: the best leaves 5.1 times the sensors' noise. It lies "
                      "mostly at: arm_rad, angle 0.4..0.8 rad."),
            std::string::npos)
      << text;
}

// What cannot be told is named, with the reason and the input that would show it.
TEST(DiagnoseReportTest, SaysWhatCannotBeSeen) {
  Diagnosis d = Unfinished();
  const std::string why = "these logs do not move what it acts on";
  d.statements = {{.use = {"backlash", "arm"}, .answer = Answer::kUnseen, .rule = kNotSimulated},
                  {.use = {"dead_zone", "motor"}, .answer = Answer::kUnseen, .rule = why},
                  {.use = {"my_own", "motor"}, .answer = Answer::kUnseen, .rule = why}};
  const std::string page = ToTable(DiagnoseRun{.info = {}, .diagnosis = d});
  for (const char* said :
       {"3 cannot be told", "cannot be told: backlash@arm; the model with it cannot be simulated",
        "cannot be told: dead_zone@motor; these logs do not move what it acts on; what would show it: ",
        "cannot be told: my_own@motor; these logs do not move what it acts on\n"})
    EXPECT_NE(page.find(said), std::string::npos) << said << "\n" << page;
}

// An interval that holds "nothing" is said so in words too.
TEST(DiagnoseReportTest, ASizeThatIsHardlyKnownIsToldAsOne) {
  Diagnosis d = Unfinished();
  Statement s{
      .use = {"cable_spring", "arm"}, .answer = Answer::kPresent, .probability = 0.9, .rule = "its own evidence"};
  s.parameters = {{.key = "stiffness_n_m_per_rad", .unit = "N m/rad", .value = 0.02, .low = 0, .high = 0.04}};
  d.statements = {s};
  EXPECT_NE(ToTable(DiagnoseRun{.info = {}, .diagnosis = d}).find("0.02 (0 .. 0.04) N m/rad, a size hardly known"),
            std::string::npos);
  d.statements[0].parameters[0].low = 0.01;
  EXPECT_EQ(ToTable(DiagnoseRun{.info = {}, .diagnosis = d}).find("hardly known"), std::string::npos);
}

TEST(DiagnoseReportTest, WhatRemainsIsToldBySignal) {
  Diagnosis d = Unfinished();
  d.verdict = Verdict::kUnknown;
  d.effects.clear();
  d.evidence.signals = {{"arm_rad", 7.21}, {"torque_n_m", 0.34}};
  EXPECT_NE(Explain(d).find("the best leaves 5.1 times the sensors' noise: arm_rad 7.2, torque_n_m 0.3."),
            std::string::npos)
      << Explain(d);
  const auto json = ToJson(DiagnoseRun{.info = {}, .diagnosis = d});
  EXPECT_EQ(json["evidence"]["floors_left_by_signal"]["arm_rad"], 7.21);
}

TEST(DiagnoseReportTest, JsonHoldsBothPlaces) {
  const auto json = ToJson(DiagnoseRun{.info = {}, .diagnosis = Unfinished()});
  EXPECT_EQ(json["where"][0]["condition"], "angle 0.4..0.8 rad");
  EXPECT_EQ(json["remains"][0]["condition"], "speed 4..9 rad/s");
  EXPECT_EQ(json["remains"][0]["share_of_time"], 0.1);
}

}  // namespace
}  // namespace gapscope
