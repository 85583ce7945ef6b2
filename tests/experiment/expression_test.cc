#include "src/experiment/expression.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace gapscope::testing {
namespace {

const std::vector<std::string> kNames = {"motor.kt", "motor.resistance", "cable_spring@arm.rest_rad", "x"};

double Value(const std::string& text, std::vector<double> variables = {2, 8, 0.5, 3}) {
  const auto parsed = Expression::Parse(text, kNames, variables.data(), "e.yaml:1:1");
  EXPECT_TRUE(parsed.ok()) << parsed.error().Text();
  return parsed.ok() ? parsed.value().Evaluate() : NAN;
}

TEST(ExpressionTest, NumbersNamesAndArithmetic) {
  EXPECT_EQ(Value("1e-10"), 1e-10);
  EXPECT_EQ(Value("-3"), -3);
  EXPECT_EQ(Value("motor.kt"), 2);
  EXPECT_EQ(Value("-motor.kt * motor.kt / motor.resistance"), -0.5);
  EXPECT_EQ(Value("cable_spring@arm.rest_rad*2"), 1);
  EXPECT_EQ(Value("x^2 / 12"), 0.75);
  EXPECT_EQ(Value("abs(x) > 1e-9 ? x : 0"), 3);
  EXPECT_EQ(Value("min(x, motor.kt)"), 2);
  EXPECT_EQ(Value("2*pi"), 2 * std::numbers::pi);
  EXPECT_EQ(Value(" 2 "), 2);
  EXPECT_DOUBLE_EQ(Value("sqrt(motor.resistance*motor.kt)+sin(0)"), 4);
}

TEST(ExpressionTest, ReadsItsVariablesAnewAndSurvivesMoves) {
  std::vector<double> variables = {2, 8, 0, 0};
  auto parsed = Expression::Parse("motor.kt / motor.resistance", kNames, variables.data(), "");
  ASSERT_TRUE(parsed.ok());
  Expression moved = std::move(parsed).value();
  EXPECT_EQ(moved.Evaluate(), 0.25);
  variables[0] = 4;
  EXPECT_EQ(moved.Evaluate(), 0.5);
  auto one_name = Expression::Parse("motor.kt", kNames, variables.data(), "");
  moved = std::move(one_name).value();
  variables[0] = 5;
  EXPECT_EQ(moved.Evaluate(), 5);
}

TEST(ExpressionTest, ParametersOfJointsWithAnyName) {
  double values[] = {2, 5, 7, 11};
  const std::vector<std::string> names = {"load@left hip.k", "load@left-hip.k", "time (s)", "k"};
  const auto both = Expression::Parse("min(load@left hip.k,load@left-hip.k)-k", names, values, "");
  ASSERT_TRUE(both.ok()) << both.error().Text();
  EXPECT_EQ(both.value().Evaluate(), 2 - 11);
  const auto alone = Expression::Parse("load@left-hip.k", names, values, "");
  ASSERT_TRUE(alone.ok());
  EXPECT_EQ(alone.value().Evaluate(), 5);
  EXPECT_FALSE(Expression::Parse("time (s)*2", names, values, "").ok());
}

TEST(ExpressionTest, UndefinedValuesAreNotFinite) {
  EXPECT_FALSE(std::isfinite(Value("1 / (x - 3)")));
  EXPECT_FALSE(std::isfinite(Value("0 / (x - 3)")));
  EXPECT_FALSE(std::isfinite(Value("sqrt(-x)")));
  EXPECT_FALSE(std::isfinite(Value("1e308 * 1e308")));
  const std::map<std::string, double> values = {{"log.kp", 0}};
  for (const char* text : {"1 / log.kp", "log.kp / log.kp", "ln(log.kp)", "1e308 * 10"}) {
    const auto value = EvaluateOnce(text, values, "e.yaml:7:3");
    ASSERT_FALSE(value.ok()) << text;
    EXPECT_NE(value.error().Text().find("is not finite"), std::string::npos) << value.error().Text();
    EXPECT_EQ(value.error().where, "e.yaml:7:3");
  }
  EXPECT_EQ(EvaluateOnce("log.kp + 1", values, "").value(), 1);
}

TEST(ExpressionTest, BadOnesSayWhatAndWhere) {
  std::vector<double> variables(kNames.size(), 1.0);
  const std::vector<std::string> bad = {"",
                                        "   ",
                                        "1 +",
                                        "(1",
                                        "1)",
                                        "motor.kt motor.kt",
                                        "1..2",
                                        "2x",
                                        "x = 5",
                                        "motor.kt = motor.kt",
                                        "x += 1",
                                        "1, 2",
                                        "\"text\"",
                                        "f(x)",
                                        "min()",
                                        "sin",
                                        "motor",
                                        "x.y",
                                        "a # b",
                                        "x[0]",
                                        "x; x",
                                        "import os",
                                        std::string(5000, '1') + "+",
                                        std::string(100, '(') + "x" + std::string(100, ')'),
                                        "inf",
                                        "nan",
                                        "1e999",
                                        "x ? 1",
                                        "x : 1",
                                        "?:",
                                        "\x01",
                                        "\xff\xfe",
                                        "x\n+",
                                        "+",
                                        "**",
                                        "x ** 2",
                                        "0x",
                                        "."};
  for (const auto& text : bad) {
    const auto parsed = Expression::Parse(text, kNames, variables.data(), "e.yaml:7:3");
    ASSERT_FALSE(parsed.ok()) << "accepted: " << text;
    EXPECT_EQ(parsed.error().where, "e.yaml:7:3");
    EXPECT_FALSE(parsed.error().what.empty());
    EXPECT_EQ(parsed.error().Text().find('\n'), std::string::npos);
  }
  // Parsing is not allowed to change a variable.
  EXPECT_EQ(variables, std::vector<double>(kNames.size(), 1.0));
}

TEST(ExpressionTest, AnUnknownNameGetsTheNearestOne) {
  std::vector<double> variables(kNames.size(), 1.0);
  const auto parsed = Expression::Parse("2 * motor.resistence", kNames, variables.data(), "e.yaml:7:3");
  ASSERT_FALSE(parsed.ok());
  EXPECT_NE(parsed.error().Text().find("did you mean 'motor.resistance'?"), std::string::npos) << parsed.error().Text();
}

}  // namespace
}  // namespace gapscope::testing
