#include "src/compare/spectrum.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <random>

namespace gapscope {
namespace {

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
constexpr double kSpectrumRounding = 1e-10;

std::vector<double> Noise(std::size_t n, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> values(n);
  for (double& value : values) value = normal(random);
  return values;
}

TEST(SpectrumTest, MedianStepIgnoresAGap) {
  const std::vector<double> time_s = {0, 0.01, 0.02, 5, 5.01};
  EXPECT_NEAR(MedianStep(time_s), 0.01, kSpectrumRounding);
  EXPECT_TRUE(std::isnan(MedianStep(std::vector<double>{1})));
  EXPECT_TRUE(std::isnan(MedianStep({})));
}

TEST(SpectrumTest, FillGapsBridgesByLinesAndHoldsTheEnds) {
  const std::vector<double> values = {kGap, 1, kGap, kGap, 4, kGap};
  EXPECT_EQ(FillGaps(values), (std::vector<double>{1, 1, 2, 3, 4, 4}));
  EXPECT_TRUE(FillGaps(std::vector<double>{kGap, kGap}).empty());
}

TEST(SpectrumTest, CrossCorrelationEqualsItsSumForOneBlockAndMany) {
  for (const std::size_t n : {1u, 5u, 700u, 5000u}) {
    for (const std::size_t max_lag : {0u, 1u, 37u}) {
      const std::vector<double> a = Noise(n, 1), b = Noise(n, 2);
      const std::vector<double> got = CrossCorrelation(a, b, max_lag);
      ASSERT_EQ(got.size(), 2 * max_lag + 1);
      for (std::size_t j = 0; j < got.size(); ++j) {
        double sum = 0;
        for (std::size_t i = 0; i < n; ++i) {
          const auto row = static_cast<long>(i + j) - static_cast<long>(max_lag);
          if (row >= 0 && row < static_cast<long>(n)) sum += a[static_cast<std::size_t>(row)] * b[i];
        }
        EXPECT_NEAR(got[j], sum, kSpectrumRounding) << n << " rows, lag " << j << " - " << max_lag;
      }
    }
  }
}

TEST(SpectrumTest, BandsAddUpToTheSignalAndToItsMeanSquare) {
  for (const std::size_t n : {1u, 2u, 7u, 997u, 1000u}) {
    const std::vector<double> values = Noise(n, 3);
    const BandSplitter splitter(values, 0.01);
    const std::size_t middle = splitter.bins() / 3;
    const std::vector<double> low = splitter.Part(0, middle), high = splitter.Part(middle, splitter.bins());
    for (std::size_t i = 0; i < n; ++i) EXPECT_NEAR(low[i] + high[i], values[i], kSpectrumRounding);
  }
  const std::vector<double> values = Noise(1000, 3);  // 1000 is a quick length: no row is mirrored twice
  const BandSplitter splitter(values, 0.01);
  const double power = std::accumulate(splitter.power().begin(), splitter.power().end(), 0.0);
  EXPECT_NEAR(power, std::inner_product(values.begin(), values.end(), values.begin(), 0.0) / 1000, kSpectrumRounding);
  EXPECT_NEAR(splitter.bin_hz(), 1 / (2 * 1000 * 0.01), kSpectrumRounding);
}

TEST(SpectrumTest, WelchGivesWhiteNoiseItsDensityAndASineItsPower) {
  const double step_s = 0.002;
  const Spectrum noise = WelchSpectrum(Noise(20000, 4), step_s, 512);
  double mean = 0;
  for (std::size_t k = 4; k < 250; ++k) mean += noise.density[k] / 246;
  EXPECT_NEAR(mean / (2 * step_s), 1, 0.03);
  EXPECT_NEAR(noise.averages, 72, 5);

  std::vector<double> sine(20000);
  for (std::size_t i = 0; i < sine.size(); ++i)
    sine[i] = 3 * std::sin(2 * M_PI * 40 * step_s * static_cast<double>(i)) + 7;
  const Spectrum line = WelchSpectrum(sine, step_s, 512);
  const double power = std::accumulate(line.density.begin(), line.density.end(), 0.0) * line.bin_hz;
  EXPECT_NEAR(power, 4.5, 0.01);
}

}  // namespace
}  // namespace gapscope
