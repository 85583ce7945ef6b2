#include "src/compare/noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace gapscope {
namespace {

constexpr double kNoSample = std::numeric_limits<double>::quiet_NaN();

std::vector<double> SampleTimes(std::size_t n, double step_s) {
  std::vector<double> time_s(n);
  for (std::size_t i = 0; i < n; ++i) time_s[i] = static_cast<double>(i) * step_s;
  return time_s;
}

// AR(1) of standard deviation one; white for phi = 0.
std::vector<double> Coloured(std::size_t n, double phi, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> values(n);
  double state = normal(random);
  for (double& value : values) {
    value = state;
    state = phi * state + std::sqrt(1 - phi * phi) * normal(random);
  }
  return values;
}

// A robot's motion: a chirp to 3 Hz, 1 rad.
std::vector<double> NoisyMotion(const std::vector<double>& time_s) {
  std::vector<double> values;
  for (const double t : time_s) values.push_back(std::sin(2 * M_PI * (0.1 * t + 0.145 * t * t)));
  return values;
}

TEST(CorrelationTimeTest, AutoregressiveNoiseHasItsClosedForm) {
  for (const double phi : {0.0, 0.5, 0.9, 0.98}) {
    double mean = 0;
    for (unsigned seed = 0; seed < 20; ++seed) mean += CorrelationTime(Coloured(20000, phi, seed), 0.01) / 20;
    EXPECT_NEAR(mean / (0.01 * (1 + phi) / (1 - phi)), 1, 0.1) << phi;
  }
}

TEST(CorrelationTimeTest, AlternatingNoiseIsNotMoreThanItsRows) {
  std::vector<double> values;
  for (int i = 0; i < 100; ++i) values.push_back(i % 2 ? 1 : -1);
  EXPECT_EQ(CorrelationTime(values, 0.01), 0.01);
}

TEST(CorrelationTimeTest, SlowSineReachesToItsFirstZero) {
  std::vector<double> values;
  for (int i = 0; i < 20000; ++i) values.push_back(std::sin(2 * M_PI * i / 1000.0));
  EXPECT_NEAR(CorrelationTime(values, 1), 1000 / M_PI, 10);  // twice the integral of a cosine's first quarter
}

TEST(CorrelationTimeTest, TinyConstantAndMissing) {
  EXPECT_TRUE(std::isnan(CorrelationTime({}, 1)));
  EXPECT_TRUE(std::isnan(CorrelationTime(std::vector<double>{1, 2}, 1)));
  EXPECT_TRUE(std::isnan(CorrelationTime(std::vector<double>(50, 0.1), 1)));
  EXPECT_TRUE(std::isnan(CorrelationTime(std::vector<double>(50, kNoSample), 1)));
  std::vector<double> values = Coloured(20000, 0.9, 1);
  const double whole = CorrelationTime(values, 1);
  for (std::size_t i = 0; i < values.size(); i += 50) values[i] = kNoSample;
  EXPECT_NEAR(CorrelationTime(values, 1) / whole, 1, 0.05);
}

TEST(EffectiveSamplesTest, ByHand) {
  EXPECT_EQ(EffectiveSamples(1000, 0), 1000);
  EXPECT_NEAR(EffectiveSamples(1000, 0.5), 1000.0 / 3, 1e-9);
  EXPECT_EQ(EffectiveSamples(1000, 1), 1);
  EXPECT_EQ(EffectiveSamples(1000, -0.5), 1000);
  EXPECT_TRUE(std::isnan(EffectiveSamples(0, 0.5)));
  EXPECT_TRUE(std::isnan(EffectiveSamples(10, kNoSample)));
  EXPECT_TRUE(std::isnan(EffectiveSamples(10, 1.5)));
}

struct Case {
  double white, coloured, tau_s;
  bool moving;
};

// Median over seeds of estimated over true total, and the share of seeds within a factor 1.5.
void ExpectTotal(const Case& c, double tolerance) {
  const double step_s = 0.002;
  const std::vector<double> time_s = SampleTimes(5000, step_s);
  std::vector<double> ratios;
  for (unsigned seed = 0; seed < 21; ++seed) {
    std::vector<double> values = c.moving ? NoisyMotion(time_s) : std::vector<double>(time_s.size());
    const std::vector<double> white = Coloured(time_s.size(), 0, 2 * seed);
    const std::vector<double> slow = Coloured(time_s.size(), std::exp(-step_s / c.tau_s), 2 * seed + 1);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] += c.white * white[i] + c.coloured * slow[i];
    ratios.push_back(EstimateNoise(time_s, values).total_std / std::hypot(c.white, c.coloured));
  }
  std::sort(ratios.begin(), ratios.end());
  printf("white %g coloured %g tau %g moving %d: ratio %.3f (%.3f..%.3f)\n", c.white, c.coloured, c.tau_s, c.moving,
         ratios[10], ratios[1], ratios[19]);
  EXPECT_NEAR(ratios[10], 1, tolerance);
  EXPECT_GT(ratios[1], 1 / 1.5);
  EXPECT_LT(ratios[19], 1.5);
}

TEST(NoiseTest, WhiteNoiseOnMotionAndAlone) {
  ExpectTotal({.white = 1e-3, .coloured = 0, .tau_s = 0.01, .moving = false}, 0.03);
  ExpectTotal({.white = 1e-3, .coloured = 0, .tau_s = 0.01, .moving = true}, 0.03);
  ExpectTotal({.white = 1e-5, .coloured = 0, .tau_s = 0.01, .moving = true}, 0.1);
}

// A sensor at a third of the log's rate: lines between its values would pass for less noise.
TEST(NoiseTest, ASlowerSensorIsJudgedOnItsOwnRows) {
  const std::vector<double> time_s = SampleTimes(15000, 0.002), motion = NoisyMotion(time_s),
                            noise = Coloured(15000, 0, 3);
  std::vector<double> values(time_s.size(), kNoSample), own_time_s, own;
  for (std::size_t i = 0; i < values.size(); i += 3) {
    values[i] = 0.1 * motion[i] + 1e-3 * noise[i];
    own_time_s.push_back(time_s[i]);
    own.push_back(values[i]);
  }
  const NoiseFloor floor = EstimateNoise(time_s, values, {});
  EXPECT_EQ(floor.total_std, EstimateNoise(own_time_s, own, {}).total_std);
  EXPECT_NEAR(floor.total_std, 1e-3, 1e-4);
}

TEST(NoiseTest, ColouredNoiseOnMotionAndAlone) {
  ExpectTotal({.white = 2e-4, .coloured = 1e-3, .tau_s = 0.01, .moving = false}, 0.1);
  ExpectTotal({.white = 2e-4, .coloured = 1e-3, .tau_s = 0.01, .moving = true}, 0.15);
  ExpectTotal({.white = 5e-4, .coloured = 5e-4, .tau_s = 0.02, .moving = true}, 0.2);
}

TEST(NoiseTest, PartsAreToldApart) {
  const double step_s = 0.002;
  const std::vector<double> time_s = SampleTimes(20000, step_s);
  const std::vector<double> white = Coloured(time_s.size(), 0, 1), slow = Coloured(time_s.size(), std::exp(-0.1), 2);
  std::vector<double> values(time_s.size());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = 1e-3 * white[i] + 2e-3 * slow[i];
  const NoiseFloor floor = EstimateNoise(time_s, values);
  EXPECT_NEAR(floor.white_std, 1e-3, 1e-4);
  EXPECT_NEAR(floor.coloured_std, 2e-3, 2e-4);
  EXPECT_NEAR(floor.correlation_time_s, 0.02, 0.005);

  const NoiseFloor only_white = EstimateNoise(time_s, white);
  EXPECT_EQ(only_white.coloured_std, 0);
  EXPECT_TRUE(std::isnan(only_white.correlation_time_s));
}

TEST(NoiseTest, QuantisationOfAMovingSignalIsSeenAndOfAStillOneIsTheResolution) {
  const std::vector<double> time_s = SampleTimes(5000, 0.002);
  const double resolution = 0.003;
  std::vector<double> values = NoisyMotion(time_s);
  for (double& value : values) value = resolution * std::round(value / resolution);
  const NoiseFloor moving = EstimateNoise(time_s, values, {.resolution = resolution, .motion_band_hz = 0});
  EXPECT_NEAR(moving.quantisation_std, resolution / std::sqrt(12.0), 1e-15);
  EXPECT_NEAR(moving.total_std / moving.quantisation_std, 1, 0.25);

  const NoiseFloor still =
      EstimateNoise(time_s, std::vector<double>(5000, 0.7), {.resolution = resolution, .motion_band_hz = 0});
  EXPECT_EQ(still.total_std, still.quantisation_std);
  EXPECT_EQ(still.coloured_std, 0);
}

TEST(NoiseTest, AGivenBandIsUsedAndTinyInputsGiveNaN) {
  const std::vector<double> time_s = SampleTimes(5000, 0.002);
  const NoiseFloor floor = EstimateNoise(time_s, Coloured(5000, 0, 3), {.resolution = 0, .motion_band_hz = 50});
  EXPECT_GE(floor.band_low_hz, 50);
  EXPECT_LE(floor.band_high_hz, 0.95 * 250);
  EXPECT_NEAR(floor.white_std, 1, 0.05);
  for (const std::size_t n : {0u, 1u, 2u, 63u}) {
    const NoiseFloor tiny =
        EstimateNoise(SampleTimes(n, 1), std::vector<double>(n, 1), {.resolution = 1, .motion_band_hz = 0});
    EXPECT_TRUE(std::isnan(tiny.total_std) && std::isnan(tiny.white_std));
    EXPECT_GT(tiny.quantisation_std, 0);
  }
  EXPECT_TRUE(std::isnan(EstimateNoise(time_s, std::vector<double>(5000, kNoSample)).total_std));
  // A band above all that the rate allows has nothing in it.
  EXPECT_TRUE(
      std::isnan(EstimateNoise(time_s, Coloured(5000, 0, 3), {.resolution = 0, .motion_band_hz = 1e300}).total_std));
  EXPECT_FALSE(std::isnan(EstimateNoise(SampleTimes(64, 0.01), Coloured(64, 0, 3)).total_std));
}

}  // namespace
}  // namespace gapscope
