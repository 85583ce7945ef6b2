// What differs between repeats of one command.
#include "src/diagnose/remainder.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gapscope {
namespace {

constexpr std::size_t kRemainderRows = 400;

Recording Sweep(const std::string& path, double amplitude) {
  Recording r;
  r.log_path = path;
  Recording::Command command;
  Recording::Measured measured{.spec = {}, .index = 0};
  for (std::size_t k = 0; k < kRemainderRows; ++k) {
    const double t = 0.01 * static_cast<double>(k);
    r.time_s.push_back(t);
    command.values.push_back(amplitude * std::sin(3 * t));
    measured.values.push_back(std::sin(3 * t));
  }
  r.timeline.median_step_s = 0.01;
  r.commands.push_back(command);
  r.measured.push_back(measured);
  return r;
}

// Predictions that miss the log by `miss` everywhere.
LogReplay Missing(const Recording& log, double miss) {
  LogReplay replay{.time_s = log.time_s};
  SignalTrace trace{.measured = log.measured[0].values, .predicted = log.measured[0].values};
  for (double& value : trace.predicted) value += miss;
  replay.signals.push_back(trace);
  return replay;
}

TEST(RepeatsTest, HalfTheSquareByWhichTwoDiffer) {
  const std::vector<Recording> logs = {Sweep("a", 1), Sweep("b", 1)};
  const double variance = 0.5;  // of a sine, over whole periods; here nearly
  EXPECT_NEAR(SquareBetweenRepeats(logs, {Missing(logs[0], 0.3), Missing(logs[1], 0.1)}), 0.5 * 0.04 / variance,
              0.05 * 0.5 * 0.04 / variance);
  // What a model misses in both alike is repeatable.
  EXPECT_NEAR(SquareBetweenRepeats(logs, {Missing(logs[0], 0.3), Missing(logs[1], 0.3)}), 0, 1e-20);
}

TEST(RepeatsTest, OtherCommandsAreNoRepeats) {
  const std::vector<Recording> logs = {Sweep("a", 1), Sweep("b", 1.1)};
  EXPECT_TRUE(std::isnan(SquareBetweenRepeats(logs, {Missing(logs[0], 0.3), Missing(logs[1], 0.1)})));
}

}  // namespace
}  // namespace gapscope
