#include "src/design/waveform.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace gapscope {
namespace {

double Peak(const std::vector<double>& values) {
  double peak = 0;
  for (const double v : values) peak = std::max(peak, std::abs(v));
  return peak;
}

TEST(WaveformTest, AllBeginAtZeroAndPeakAtOne) {
  for (const WaveShape shape :
       {WaveShape::kChirp, WaveShape::kSteps, WaveShape::kTriangle, WaveShape::kMultisine, WaveShape::kSquare}) {
    const auto values = SampleWaveform({.shape = shape, .duration_s = 10, .low_hz = 0.5, .high_hz = 5, .seed = 3}, 400);
    ASSERT_TRUE(values.ok()) << NameOf(shape);
    EXPECT_EQ(values.value().size(), 4001u);
    EXPECT_NEAR(Peak(values.value()), 1, 0.02) << NameOf(shape);
    EXPECT_NEAR(values.value()[0], shape == WaveShape::kSquare ? 1 : 0, 1e-9) << NameOf(shape);
  }
}

TEST(WaveformTest, SquareOfTheFlexibleJointTurnsEvery315Milliseconds) {
  const auto values = SampleWaveform({.shape = WaveShape::kSquare, .duration_s = 6.3, .low_hz = 1 / 0.63}, 1000);
  ASSERT_TRUE(values.ok());
  for (std::size_t k = 0; k < 6300; ++k) EXPECT_EQ(values.value()[k], (k / 315) % 2 == 0 ? 1 : -1) << k;
}

TEST(WaveformTest, TriangleHasConstantSlope) {
  const auto values = SampleWaveform({.shape = WaveShape::kTriangle, .duration_s = 4, .low_hz = 0.5}, 100);
  ASSERT_TRUE(values.ok());
  for (std::size_t k = 0; k + 1 < values.value().size(); ++k)
    EXPECT_NEAR(std::abs(values.value()[k + 1] - values.value()[k]), 0.02, 1e-9) << k;
  EXPECT_NEAR(values.value()[50], 1, 1e-9);
  EXPECT_NEAR(values.value()[150], -1, 1e-9);
}

TEST(WaveformTest, AMirroredOneGoesBack) {
  Waveform wave{.shape = WaveShape::kTriangle, .duration_s = 4, .low_hz = 0.5};
  const auto once = SampleWaveform(wave, 100);
  wave.duration_s = 8, wave.mirrored = true;
  const auto both = SampleWaveform(wave, 100);
  ASSERT_TRUE(once.ok() && both.ok());
  ASSERT_EQ(both.value().size(), 801u);
  double sum = 0;
  for (std::size_t k = 0; k <= 400; ++k) {
    EXPECT_EQ(both.value()[k], once.value()[k]) << k;
    EXPECT_NEAR(both.value()[400 + k], -once.value()[k], 1e-9) << k;
  }
  for (const double value : both.value()) sum += value;
  EXPECT_NEAR(sum, 0, 1e-9);
}

// Past the fade-in only multiples of 1 / duration inside the band hold power.
TEST(WaveformTest, MultisineKeepsItsBand) {
  const double duration = 20, rate = 100;
  const auto values =
      SampleWaveform({.shape = WaveShape::kMultisine, .duration_s = duration, .low_hz = 1, .high_hz = 5}, rate);
  ASSERT_TRUE(values.ok());
  double inside = 0, outside = 0;
  for (int line = 1; line < 1000; ++line) {
    std::complex<double> sum = 0;
    for (std::size_t k = 0; k < 2000; ++k)
      sum += values.value()[k] * std::polar(1.0, -2 * std::numbers::pi * line * static_cast<double>(k) / 2000);
    (line >= 18 && line <= 102 ? inside : outside) += std::norm(sum);
  }
  EXPECT_LT(outside, 0.02 * inside);
  // A low peak: less than half of what 24 sines of equal size have when all pass their peaks at once, sqrt(2 * 24)
  // = 6.9 root mean squares.
  double square = 0;
  for (std::size_t k = 200; k < 2000; ++k) square += values.value()[k] * values.value()[k];
  EXPECT_LT(1 / std::sqrt(square / 1800), 0.5 * std::sqrt(48.0));
}

TEST(WaveformTest, StepsAreSeededAndRestAtBothEnds) {
  const Waveform wave{.shape = WaveShape::kSteps, .duration_s = 10, .low_hz = 0.5, .high_hz = 1, .seed = 7};
  Waveform other = wave;
  other.seed = 8;
  const auto a = SampleWaveform(wave, 200), b = SampleWaveform(wave, 200), c = SampleWaveform(other, 200);
  ASSERT_TRUE(a.ok() && b.ok() && c.ok());
  EXPECT_EQ(a.value(), b.value());
  EXPECT_NE(a.value(), c.value());
  for (std::size_t k = 0; k < 200; ++k) EXPECT_EQ(a.value()[k], 0);
  for (std::size_t k = 1801; k < 2001; ++k) EXPECT_EQ(a.value()[k], 0);
  EXPECT_LT(*std::min_element(a.value().begin(), a.value().end()), -0.25);
}

TEST(WaveformTest, RefusesWhatCannotBeSampled) {
  const Waveform good{.shape = WaveShape::kChirp, .duration_s = 10, .low_hz = 0.1, .high_hz = 5};
  EXPECT_TRUE(SampleWaveform(good, 100).ok());
  EXPECT_FALSE(SampleWaveform(good, 10).ok());
  EXPECT_FALSE(SampleWaveform(good, 1e9).ok());
  EXPECT_FALSE(SampleWaveform(good, std::nan("")).ok());
  Waveform reversed{.shape = WaveShape::kMultisine, .duration_s = 10, .low_hz = 5, .high_hz = 1};
  EXPECT_FALSE(SampleWaveform(reversed, 100).ok());
}

}  // namespace
}  // namespace gapscope
