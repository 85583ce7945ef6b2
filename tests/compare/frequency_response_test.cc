#include "src/compare/frequency_response.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace gapscope {
namespace {

TEST(EstimateResponseTest, FindsAFirstOrderLagAndAGain) {
  // y' = (3 u - y) / T exactly, u held; the prediction is u itself.
  constexpr double kStep = 0.002, kTime = 0.05, kGain = 3;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::vector<double> time, u, y;
  double state = 0;
  for (int k = 0; k < 20000; ++k) {
    time.push_back(k * kStep);
    u.push_back(normal(random));
    y.push_back(state);
    state += (1 - std::exp(-kStep / kTime)) * (kGain * u.back() - state);
  }
  const auto points = EstimateResponse(time, u, y, u);
  ASSERT_GT(points.size(), 20u);
  int compared = 0;
  for (const auto& p : points) {
    if (p.hz < 0.3 || p.hz > 30) continue;
    const double w = 2 * std::numbers::pi * p.hz * kTime;
    // The command is held for a step and read at its end: half a step late, to first order.
    EXPECT_NEAR(p.measured_gain, kGain / std::sqrt(1 + w * w), 0.06 * kGain / std::sqrt(1 + w * w)) << p.hz;
    EXPECT_NEAR(p.measured_phase_deg, -std::atan(w) * 180 / std::numbers::pi - 180 * p.hz * kStep, 5) << p.hz;
    EXPECT_NEAR(p.predicted_gain, 1, 1e-9);
    EXPECT_NEAR(p.predicted_phase_deg, 0, 1e-9);
    EXPECT_GT(p.coherence, 0.8);
    ++compared;
  }
  EXPECT_GT(compared, 15);
}

TEST(EstimateResponseTest, SaysNothingOfWhatWasNotExcited) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  std::vector<double> time, u, noise, still;
  for (int k = 0; k < 8000; ++k) {
    time.push_back(0.002 * k);
    u.push_back(std::sin(2 * std::numbers::pi * 2 * time.back()));
    noise.push_back(normal(random));
    still.push_back(1);
  }
  // Segments of 1024 rows: bins of 0.49 Hz, and a Hann window spreads a line over two bins and a fraction to each side.
  for (const auto& p : EstimateResponse(time, u, u, u)) EXPECT_NEAR(p.hz, 2, 2.2 / (1024 * 0.002));
  EXPECT_TRUE(EstimateResponse(time, u, noise, u).empty());
  EXPECT_TRUE(EstimateResponse(time, still, u, u).empty());
  EXPECT_TRUE(EstimateResponse(std::span(time).first(100), std::span(u).first(100), std::span(u).first(100),
                               std::span(u).first(100))
                  .empty());
}

}  // namespace
}  // namespace gapscope
