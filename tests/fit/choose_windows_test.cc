// Which windows are taken of logs that have more than enough.
#include "src/fit/choose_windows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "src/fit/windows.h"

namespace gapscope {
namespace {

constexpr std::size_t kRate = 100;

// At rest but for the seconds in `moving`, in each of which it turns once, as far as its place in the list says.
Recording MostlyAtRest(std::size_t seconds, const std::vector<std::size_t>& moving) {
  Recording recording;
  recording.measured.push_back({.spec = {}, .index = 0, .column = "angle", .values = {}});
  recording.commands.push_back({.actuator = "motor", .column = {}, .values = {}});
  for (std::size_t row = 0; row < seconds * kRate; ++row) {
    const double t = static_cast<double>(row) / kRate;
    const auto place = std::find(moving.begin(), moving.end(), row / kRate);
    const double size = place == moving.end() ? 0 : 1 + static_cast<double>(place - moving.begin());
    recording.time_s.push_back(t);
    recording.measured[0].values.push_back(size * std::sin(2 * std::numbers::pi * t));
    recording.commands[0].values.push_back(size * std::cos(2 * std::numbers::pi * t));
  }
  return recording;
}

std::vector<LogWindow> Seconds(std::size_t log, const Recording& recording) {
  std::vector<LogWindow> windows;
  for (std::size_t begin = 0; begin < recording.rows(); begin += kRate)
    windows.push_back({log, {begin, begin + kRate}});
  return windows;
}

std::set<std::size_t> SecondsOf(const std::vector<LogWindow>& windows) {
  std::set<std::size_t> seconds;
  for (const LogWindow& window : windows) seconds.insert(window.rows.begin / kRate);
  return seconds;
}

TEST(ChooseWindowsTest, MotionIsFoundInALongRest) {
  const Recording recording = MostlyAtRest(1000, {17, 303, 304, 808});
  const auto chosen = SecondsOf(ChooseWindows({recording}, Seconds(0, recording), 12));
  EXPECT_EQ(chosen.size(), 12u);
  for (const std::size_t second : {17u, 303u, 304u, 808u}) EXPECT_TRUE(chosen.contains(second)) << second;
}

// One window of the many that repeat each other says nearly all of it, so the single one of each other kind is in.
TEST(ChooseWindowsTest, WhatIsRareCountsAsMuchAsWhatIsCommon) {
  std::vector<std::size_t> many(200);
  for (std::size_t i = 0; i < many.size(); ++i) many[i] = i;
  Recording recording = MostlyAtRest(220, many);
  for (std::size_t row = 0; row < recording.rows(); ++row) {
    const std::size_t second = row / kRate;
    const double size = second == 77 ? 3 : second < 200 ? 1 : 0;
    recording.measured[0].values[row] = size * std::sin(2 * std::numbers::pi * recording.time_s[row]);
    recording.commands[0].values[row] = 0;
  }
  EXPECT_TRUE(SecondsOf(ChooseWindows({recording}, Seconds(0, recording), 10)).contains(77));
}

TEST(ChooseWindowsTest, FewEnoughAreAllTakenInTheirOrder) {
  const Recording recording = MostlyAtRest(9, {2});
  EXPECT_EQ(ChooseWindows({recording}, Seconds(0, recording), 9).size(), 9u);
  const auto some = ChooseWindows({recording}, Seconds(0, recording), 5);
  for (std::size_t i = 1; i < some.size(); ++i) EXPECT_LT(some[i - 1].rows.begin, some[i].rows.begin);
}

// What no log measures, a log that lacks a signal, and one that does not move at all are no reason to stop.
TEST(ChooseWindowsTest, LogsNeedNotBeAlike) {
  const Recording moving = MostlyAtRest(30, {4}), resting = MostlyAtRest(30, {});
  Recording other = MostlyAtRest(30, {9});
  other.measured.clear();
  other.commands[0].values[120] = std::numeric_limits<double>::quiet_NaN();
  std::vector<LogWindow> windows = Seconds(0, moving);
  for (const auto& more : {Seconds(1, resting), Seconds(2, other)})
    windows.insert(windows.end(), more.begin(), more.end());
  const auto chosen = ChooseWindows({moving, resting, other}, windows, 20);
  ASSERT_EQ(chosen.size(), 20u);
  EXPECT_TRUE(
      std::any_of(chosen.begin(), chosen.end(), [](const auto& w) { return w.log == 0 && w.rows.begin == 400; }));
}

// Before a log's first row nobody knows what was commanded.
TEST(TakenWindowsTest, NoneBeginsWhereAnUnknownPastMayAct) {
  const Recording recording = MostlyAtRest(4, {0, 1, 2, 3});
  const std::vector<LogWindow> seconds = TakenWindows({recording}, {});
  ASSERT_EQ(seconds.size(), 4u);
  EXPECT_DOUBLE_EQ(recording.time_s[seconds[0].rows.begin], 0.08);
  EXPECT_DOUBLE_EQ(recording.time_s[seconds[1].rows.begin], 1);
  // Of windows of a tenth of a second the first one has too little left.
  const std::vector<LogWindow> tenths = TakenWindows({recording}, {.window_s = 0.1});
  EXPECT_DOUBLE_EQ(recording.time_s[tenths[0].rows.begin], 0.1);
  const std::vector<LogWindow> whole = TakenWindows({MostlyAtRest(1, {0})}, {.window_s = 5});
  ASSERT_EQ(whole.size(), 1u);
  EXPECT_EQ(whole[0].rows.begin, 8u);
  // What stands still was not acted upon.
  EXPECT_EQ(TakenWindows({MostlyAtRest(4, {1})}, {})[0].rows.begin, 0u);
}

}  // namespace
}  // namespace gapscope
