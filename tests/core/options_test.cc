#include "src/core/options.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gapscope {

enum class Colour { kRed, kBlue };
template <>
std::span<const EnumName<Colour>> EnumNames<Colour>() {
  static constexpr EnumName<Colour> kNames[] = {{Colour::kRed, "red"}, {Colour::kBlue, "blue"}};
  return kNames;
}

struct PaintOptions {
  double width_m = 0.5, from_s = -1;  // from_s below zero: at once
  int coats = 2;
  Colour colour = Colour::kRed;
  std::vector<double> shades = {1, 2.5};
};

std::vector<Option> OptionsOf(PaintOptions& o) {
  return {{.flag = "--width", .value = &o.width_m, .unit = "m", .range = Above(0), .help = "Of the brush"},
          {.flag = "--from", .value = &o.from_s, .unit = "s", .range = AtLeast(0, -1), .unset = "at once"},
          {.flag = "--coats", .value = &o.coats, .range = Between(1, 9)},
          {.flag = "--colour", .value = ChoiceOf(o.colour)},
          {.flag = "--shades", .value = &o.shades, .range = AtLeast(0), .commas = true}};
}

namespace {

std::string Refusal(const Status& status) { return status.ok() ? "" : status.error().Text(); }

TEST(OptionsTest, DescribeThemselves) {
  PaintOptions paint;
  const auto options = OptionsOf(paint);
  EXPECT_EQ(options[0].Kind() + "|" + options[0].Allowed() + "|" + options[0].Default(), "NUMBER|m, above 0|0.5");
  EXPECT_EQ(options[1].Allowed() + "|" + options[1].Default(), "s, at least 0|at once");
  EXPECT_EQ(options[2].Kind() + "|" + options[2].Allowed() + "|" + options[2].Default(), "COUNT|1 .. 9|2");
  EXPECT_EQ(options[3].Kind() + "|" + options[3].Default(), "{red,blue}|red");
  EXPECT_EQ(options[4].Default(), "1,2.5");
}

TEST(OptionsTest, ReadWhatTheyMayHold) {
  PaintOptions paint;
  const auto options = OptionsOf(paint);
  EXPECT_TRUE(options[0].Read({"2e-1"}).ok());
  EXPECT_TRUE(options[1].Read({"0"}).ok());
  EXPECT_TRUE(options[2].Read({"+9"}).ok());
  EXPECT_TRUE(options[3].Read({"blue"}).ok());
  EXPECT_TRUE(options[4].Read({"3", "4"}).ok());
  EXPECT_EQ(paint.width_m, 0.2);
  EXPECT_EQ(paint.from_s, 0);
  EXPECT_EQ(paint.coats, 9);
  EXPECT_EQ(paint.colour, Colour::kBlue);
  EXPECT_EQ(paint.shades, (std::vector<double>{3, 4}));
  EXPECT_TRUE(Validate(paint).ok());
}

TEST(OptionsTest, RefuseTheRestAndSayWhy) {
  PaintOptions paint;
  const auto options = OptionsOf(paint);
  for (const char* text : {"0", "-1", "nan", "inf", "1e999", "", "1 ", "0x2", "1,5", "+-1"}) {
    const std::string said = Refusal(options[0].Read({text}));
    EXPECT_EQ(said, "--width: not a value it can have: got '" + std::string(text) +
                        "', allowed: a finite number above 0 (m)");
  }
  EXPECT_NE(Refusal(options[1].Read({"-1"})), "");  // the value that stands for "not given" cannot be given
  for (const char* text : {"0", "10", "2.5", "99999999999"}) {
    EXPECT_EQ(Refusal(options[2].Read({text})),
              "--coats: not a value it can have: got '" + std::string(text) + "', allowed: a whole number 1 .. 9");
  }
  EXPECT_EQ(Refusal(options[3].Read({"bleu"})),
            "--colour: not one of its words: got 'bleu', allowed: red, blue; did you mean 'blue'?");
  EXPECT_NE(Refusal(options[4].Read({"3", "-4"})), "");
  EXPECT_EQ(paint.shades, (std::vector<double>{1, 2.5}));  // nothing is written
}

TEST(OptionsTest, ValidateLooksAtPresentValues) {
  EXPECT_TRUE(Validate(PaintOptions{}).ok());
  EXPECT_TRUE(Validate(PaintOptions{.from_s = 3}).ok());
  EXPECT_NE(Refusal(Validate(PaintOptions{.from_s = -2})), "");
  EXPECT_NE(Refusal(Validate(PaintOptions{.width_m = std::nan("")})), "");
  EXPECT_NE(Refusal(Validate(PaintOptions{.coats = 0})), "");
  EXPECT_NE(Refusal(Validate(PaintOptions{.shades = {1, INFINITY}})), "");
}

}  // namespace
}  // namespace gapscope
