// Units of formulas: those that people write agree, and mistakes are told by the part of the formula that holds them.
#include "src/experiment/formula_units.h"

#include <gtest/gtest.h>

namespace gapscope::testing {
namespace {

const std::map<std::string, std::string> kUnits = {
    {"angle", "rad"},      {"speed", "rad/s"}, {"command", "V"},      {"time", "s"},
    {"a", "N m"},          {"k", "N m/rad"},   {"b", "N m s/rad"},    {"drag", "N m s^2/rad^2"},
    {"rest", "rad"},       {"at", "rad/s"},    {"share", "1"},        {"kt", "N m/A"},
    {"resistance", "ohm"}, {"period", "s"},    {"inertia", "kg m^2"}, {"heat", "N^2 m^2"},
};

// The error's text; "": none.
std::string Said(const std::string& formula, const std::string& result = "N m") {
  const Status checked = CheckFormulaUnits(formula, kUnits, result, "e.yaml:4:13");
  return checked.ok() ? "" : checked.error().Text();
}

TEST(FormulaUnitsTest, WhatPeopleWriteAgrees) {
  for (const char* formula : {
           "a * sin(angle - rest)",
           "-k * (angle - rest)",
           "-drag * speed * abs(speed)",
           "a * tanh(speed / at)",
           "a * (1 + share * cos(2 * angle)) * sign(speed)",
           "speed > 0 ? -a : b * speed",
           "-share * kt * command / resistance",
           "k * min(angle, rest) + a * exp(-time / period)",
           "a * exp(-(speed / at)^2)",
           "sqrt(heat) * atan2(angle, rest)",
           "inertia * speed / time",
           "a * sin(2 * pi * time / period) * (abs(speed) < at && angle > rest)",
           "a^1",
       })
    EXPECT_EQ(Said(formula), "") << formula;
}

// A number may be 0.5 N m s/rad: nothing can be said of what it enters.
TEST(FormulaUnitsTest, ANumberMayHaveAnyUnit) {
  for (const char* formula : {"0.5 * speed", "a * sin(5 * time)", "share * angle * 3", "a + 0.1", "unknown * speed",
                              "a * sin(angle", "a * angle^share"})
    EXPECT_EQ(Said(formula), "") << formula;
}

TEST(FormulaUnitsTest, MistakesAreTold) {
  const auto says = [](const std::string& formula, const std::string& part) {
    EXPECT_NE(Said(formula).find(part), std::string::npos) << formula << ": " << Said(formula);
    EXPECT_NE(Said(formula).find("e.yaml:4:13"), std::string::npos);
  };
  says("a * speed", "kg m^2 s^-3");
  says("-b * (angle - rest)", "kg m^2 s^-1");
  says("a * sin(speed)", "'sin(speed)': sin of s^-1");
  says("k * (angle - speed)", "'angle - speed': 1 beside s^-1");
  says("speed > rest ? a : -a", "'speed > rest': s^-1 beside 1");
  says("angle > rest ? a : b", "kg m^2 s^-2 beside kg m^2 s^-1");
  says("a * exp(-time)", "exp of s");
  says("a * share^time", "a power of s");
  says("a * min(angle, time)", "'min(angle, time)': 1 beside s");
  says("share * command", "kg m^2 s^-3 A^-1");
  EXPECT_NE(Said("a * sin(angle)", "N"), "");
}

}  // namespace
}  // namespace gapscope::testing
