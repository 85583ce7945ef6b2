#include "src/log/signal_checks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace gapscope {
namespace {

std::vector<double> Make(int count, const std::function<double(int)>& f) {
  std::vector<double> values;
  for (int k = 0; k < count; ++k) values.push_back(f(k));
  return values;
}

TEST(SignalChecksTest, QuantisationOfAnEncoder) {
  for (const double step :
       {2 * std::numbers::pi / 2048, 0.0015339807878856412, 0.229 * 2 * std::numbers::pi / 60, 1.0}) {
    const auto values = Make(2000, [&](int k) { return step * std::round(300 * std::sin(0.01 * k)); });
    EXPECT_NEAR(QuantisationStep(values), step, 1e-6 * step);
  }
}

TEST(SignalChecksTest, QuantisationWithOffsetAndRoundingInTheFile) {
  const double step = 0.00306796;
  const auto values =
      Make(2000, [&](int k) { return std::round((0.0123 + step * std::round(80 * std::sin(0.01 * k))) * 1e7) / 1e7; });
  EXPECT_NEAR(QuantisationStep(values), step, 1e-3 * step);
}

TEST(SignalChecksTest, NoQuantisationOfSmoothOrNoisySignals) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 1e-3);
  EXPECT_EQ(QuantisationStep(Make(2000, [](int k) { return std::sin(0.0137 * k); })), 0);
  EXPECT_EQ(QuantisationStep(Make(2000, [&](int) { return noise(random); })), 0);
  EXPECT_EQ(QuantisationStep(Make(2000, [&](int k) { return std::sin(0.01 * k) + noise(random); })), 0);
  EXPECT_EQ(QuantisationStep(Make(2000, [](int) { return 3.0; })), 0);
  EXPECT_EQ(QuantisationStep({}), 0);
  EXPECT_EQ(QuantisationStep(Make(20, [](int k) { return k % 2 ? 1e308 : -1e308; })), 0);
}

TEST(SignalChecksTest, NoiseOfAKnownSize) {
  std::mt19937 random(9);
  std::normal_distribution<double> noise(0, 0.01);
  const auto values = Make(5000, [&](int k) { return std::sin(0.005 * k) + noise(random); });
  constexpr double kSampling = 0.05;  // relative, of a median over 5000 correlated values
  EXPECT_NEAR(NoiseEstimate(values, 0), 0.01, kSampling * 0.01);
}

TEST(SignalChecksTest, RestOnACountIsNotSaturation) {
  // A quantised position that comes to rest at its largest value, one count at a time.
  const auto values = Make(600, [](int k) { return 0.01 * std::round(100 * (1 - std::exp(-0.02 * k))); });
  EXPECT_EQ(FindSaturation(values).count, 0u);
}

TEST(SignalChecksTest, TurningPointsInCountsAreNotSaturation) {
  for (const double speed : {0.005, 0.02, 0.05}) {
    const auto values = Make(3000, [&](int k) { return 0.00153 * std::round(std::sin(speed * k) / 0.00153); });
    EXPECT_EQ(FindSaturation(values).count, 0u) << speed;
  }
}

TEST(SignalChecksTest, SetPointsAreNotSaturation) {
  // A ramp to a target that is held to the end, and a square wave with ramped flanks.
  EXPECT_EQ(FindSaturation(Make(600, [](int k) { return std::min(1.0, 0.01 * k); })).count, 0u);
  EXPECT_EQ(FindSaturation(Make(900, [](int k) { return std::clamp(10 * std::sin(0.02 * k), -1.0, 1.0); })).count, 0u);
}

TEST(SignalChecksTest, SquareWaveIsNotSaturation) {
  EXPECT_EQ(FindSaturation(Make(600, [](int k) { return (k / 50) % 2 ? 1.0 : -1.0; })).count, 0u);
}

TEST(SignalChecksTest, ClippingIsSaturation) {
  const auto values = Make(1000, [](int k) { return std::min(0.5, std::sin(0.05 * k)); });
  const Saturation found = FindSaturation(values);
  EXPECT_TRUE(found.at_high);
  EXPECT_FALSE(found.at_low);
  EXPECT_EQ(found.high, 0.5);
  EXPECT_EQ(found.first, static_cast<std::size_t>(std::find(values.begin(), values.end(), 0.5) - values.begin()));
}

TEST(SignalChecksTest, UnwrapUndoesWrapForAnySlowSignal) {
  std::mt19937 random(2);
  for (int round = 0; round < 50; ++round) {
    const double period = std::uniform_real_distribution<double>(0.5, 5000)(random);
    std::vector<double> truth = {0}, wrapped = {0};
    for (int k = 0; k < 200; ++k) {
      truth.push_back(truth.back() + std::uniform_real_distribution<double>(-0.49, 0.49)(random) * period);
      wrapped.push_back(std::remainder(truth.back(), period));
    }
    Unwrap(period, &wrapped);
    for (std::size_t k = 0; k < truth.size(); ++k) ASSERT_NEAR(wrapped[k], truth[k], 1e-9 * period);
  }
}

TEST(SignalChecksTest, SquareWaveOfTwoPiIsNotTakenForWrapsWithoutReason) {
  const auto values = Make(300, [](int k) { return 5 * std::sin(0.1 * k); });
  EXPECT_EQ(FindUndeclaredWraps(values, 2 * std::numbers::pi).count, 0u);
}

}  // namespace
}  // namespace gapscope
