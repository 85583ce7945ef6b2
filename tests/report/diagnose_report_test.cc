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
  d.verdict = Verdict::kUnknown;
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

TEST(DiagnoseReportTest, UnknownSaysWhatWasFoundAndWhereTheRestLies) {
  const Diagnosis d = Unfinished();
  EXPECT_NE(d.explanation.find("cable_spring@arm explains 100 % of the gap that closes"), std::string::npos)
      << d.explanation;
  EXPECT_NE(d.explanation.find("5.1 times the noise, and no known effect explains what remains. It lies mostly at: "
                               "arm_rad, speed 4..9 rad/s."),
            std::string::npos)
      << d.explanation;
  const std::string page = ToTable(DiagnoseRun{.info = {}, .diagnosis = d});
  EXPECT_LT(page.find("angle 0.4..0.8 rad"), page.find("\nwhat remains"));
  EXPECT_LT(page.find("\nwhat remains"), page.rfind("speed 4..9 rad/s"));
}

TEST(DiagnoseReportTest, UnknownWithoutAnEffectSaysWhereTheGapLies) {
  Diagnosis d = Unfinished();
  d.effects.clear();
  d.remains = d.where;
  const std::string text = Explain(d);
  EXPECT_NE(text.find("No known effect explains what remains: the best leaves 5.1 times the sensors' noise. It lies "
                      "mostly at: arm_rad, angle 0.4..0.8 rad."),
            std::string::npos)
      << text;
}

TEST(DiagnoseReportTest, WhatRemainsIsToldBySignal) {
  Diagnosis d = Unfinished();
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
