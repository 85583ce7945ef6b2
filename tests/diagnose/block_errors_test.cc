#include "src/diagnose/block_errors.h"

#include <gtest/gtest.h>

#include <cmath>

#include "src/core/statistics.h"
#include "src/diagnose/left_out.h"

namespace gapscope {
namespace {

// `rows` rows, 0.1 s apart, that are predicted `off` too large.
LogReplay Log(std::size_t rows, double off, bool scored_too) {
  LogReplay log;
  for (const bool scored : {true, scored_too}) {
    SignalTrace trace{.signal = "angle", .scored = scored};
    for (std::size_t r = 0; r < rows; ++r) {
      trace.measured.push_back(std::sin(0.7 * static_cast<double>(r)));
      trace.predicted.push_back(r == 0 ? kNaN : trace.measured.back() + off * (1 + static_cast<double>(r % 3)));
    }
    log.signals.push_back(trace);
  }
  for (std::size_t r = 0; r < rows; ++r) log.time_s.push_back(0.1 * static_cast<double>(r) + 0.05);
  return log;
}

TEST(BlockErrorsTest, NormalisedOnesAddUpToTheReplaysError) {
  const std::vector<LogReplay> logs = {Log(40, 0.3, true), Log(25, 0.1, false)};
  const BlockSquares squares = NormalisedSquares(ErrorsByBlock(logs));
  double sum = 0;
  for (const auto& [block, square] : squares) sum += square;
  EXPECT_NEAR(std::sqrt(sum), ReplayError(logs), 1e-12);
  EXPECT_EQ(squares.size(), 8U + 5U);  // 4 s and 2.5 s
}

TEST(BlockErrorsTest, EachLogHasItsOwnError) {
  const std::vector<LogReplay> logs = {Log(40, 0.3, true), Log(25, 0.1, false)};
  const std::vector<double> errors = NormalisedErrors(ErrorsByBlock(logs));
  ASSERT_EQ(errors.size(), 2U);
  EXPECT_NEAR(errors[0], ReplayError({logs[0]}), 1e-12);
  EXPECT_NEAR(errors[1], ReplayError({logs[1]}), 1e-12);
}

TEST(BlockErrorsTest, HalfSecondsHoldWhatWasMissedInThem) {
  LogReplay log = Log(20, 0, true);
  log.signals[0].predicted[7] += 2;  // at 0.75 s
  const BlockSquares squares =
      SquaresByBlock(ErrorsByBlock({log}), [](std::size_t, std::size_t s) { return s == 0 ? 3 : 1; });
  for (const auto& [block, square] : squares) EXPECT_NEAR(square, block.second == 1 ? 12 : 0, 1e-12);
}

// A signal whose noise is larger than its error hides nothing of the one beside it.
TEST(FloorErrorTest, NoSignalsNoiseIsMoreThanItsError) {
  LogReplay log;
  Recording recording;
  for (const double off : {0.3, 0.1}) {
    SignalTrace trace{.scored = true};
    Recording::Measured measured{.index = recording.measured.size()};
    measured.spec.scored = true;
    for (int r = 0; r < 40; ++r) {
      measured.values.push_back(r % 2);
      trace.measured.push_back(r % 2);
      trace.predicted.push_back(r % 2 + off);
    }
    log.signals.push_back(trace);
    recording.measured.push_back(measured);
  }
  for (int r = 0; r < 40; ++r) log.time_s.push_back(0.1 * r);
  const BlockErrors errors = ErrorsByBlock({log});
  const double deviation = MomentsOf(log.signals[0].measured).deviation;
  const auto floor = [&](double first, double second) {
    return deviation * FloorError({&recording, 1}, errors, {first, second});
  };
  EXPECT_NEAR(floor(0.03, 0.04), std::sqrt((0.03 * 0.03 + 0.04 * 0.04) / 2), 1e-9);
  EXPECT_NEAR(floor(0.03, 0.8), std::sqrt((0.03 * 0.03 + 0.1 * 0.1) / 2), 1e-9);
  EXPECT_NEAR(deviation * FloorError({&recording, 1}, {}, {0.03, 0.8}), std::sqrt((0.03 * 0.03 + 0.64) / 2), 1e-9);
}

}  // namespace
}  // namespace gapscope
