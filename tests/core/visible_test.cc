#include "src/core/visible.h"

#include <gtest/gtest.h>

namespace gapscope {
namespace {

TEST(VisibleTest, PlainTextStays) {
  for (const std::string text : {"", "arm_rad 0.5 N m", "größe 5 μm\n\tx", "▂▅█ – “quoted” 日本語 🤖"})
    EXPECT_EQ(MadeVisible(text), text);
}

TEST(VisibleTest, WhatHidesIsMadeVisible) {
  EXPECT_EQ(MadeVisible("a\033[2Jb"), "a\\u001b[2Jb");
  EXPECT_EQ(MadeVisible("a\rb\b\x7f"), "a\\u000db\\u0008\\u007f");
  EXPECT_EQ(MadeVisible("log\u202Evsc.exe"), "log\\u202evsc.exe");
  EXPECT_EQ(MadeVisible("\u200f\u2066\u061c"), "\\u200f\\u2066\\u061c");
  EXPECT_EQ(MadeVisible("\xc2\x9b"), "\\u009b");  // a control sequence in one character
  EXPECT_EQ(MadeVisible("\u202E", "%"), "%202e");
}

TEST(VisibleTest, OwnColoursStayAndNoOthers) {
  EXPECT_EQ(MadeVisible("\033[31mbad\033[0m"), "\033[31mbad\033[0m");
  EXPECT_EQ(MadeVisible("\033[8mhidden"), "\\u001b[8mhidden");
}

TEST(VisibleTest, BytesThatAreNoUtf8Stay) {
  EXPECT_EQ(MadeVisible("x\xff\xe2\x80"), "x\xff\xe2\x80");
  EXPECT_EQ(MadeVisible("\xe2\x80\xaex"), "\\u202ex");
}

}  // namespace
}  // namespace gapscope
