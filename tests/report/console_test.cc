#include "src/report/console.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>

namespace gapscope {
namespace {

TEST(ConsoleTest, IsPlainUnlessAskedForColour) {
  EXPECT_EQ(Console{}.Bad("x"), "x");
  EXPECT_EQ(Console{.colour = true}.Bad("x"), "\033[31mx\033[0m");
  // A test's output is no terminal.
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  EXPECT_FALSE(ConsoleOf(ends[1]).colour);
}

TEST(SparklineTest, OneBlockAValue) {
  const double values[] = {0, 1, 4, 8, NAN, 8.1};
  EXPECT_EQ(Sparkline(values), "\u2581\u2581\u2584\u2588 \u2588");
  const double nothing[] = {0, 0};
  EXPECT_EQ(Sparkline(nothing), "\u2581\u2581");
}

TEST(ErrorOverTimeTest, RootMeanSquareOfEachPart) {
  const double time[] = {0, 1, 2, 3, 4}, measured[] = {1, 2, 3, 4, 5}, predicted[] = {1, 2, 0, NAN, 1};
  const auto parts = ErrorOverTime(time, measured, predicted, 2);
  EXPECT_DOUBLE_EQ(parts[0], 0);
  EXPECT_DOUBLE_EQ(parts[1], std::sqrt((9.0 + 16.0) / 2));
  EXPECT_TRUE(std::isnan(ErrorOverTime(time, measured, predicted, 10)[1]));
}

// The shell reads it as one line.
TEST(ConsoleTest, ACommandIsBrokenBeforeOptions) {
  const std::string command = "gapscope design steps rig.yaml --duration 8 --rate 250 --out next.csv";
  EXPECT_EQ(WrappedCommand(command, 120), command);
  EXPECT_EQ(WrappedCommand(command, 50),
            "gapscope design steps rig.yaml --duration 8 \\\n    --rate 250 --out next.csv");
}

}  // namespace
}  // namespace gapscope
