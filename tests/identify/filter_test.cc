#include "src/identify/filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace gapscope {
namespace {

Recording Timeline(std::size_t rows, double dt) {
  Recording r;
  for (std::size_t k = 0; k < rows; ++k) r.time_s.push_back(dt * static_cast<double>(k));
  r.timeline.median_step_s = dt;
  return r;
}

// A Gaussian leaves straight lines as they are, adds a constant to parabolas, and scales a sine by exp(-(w s)^2 / 2): 1
// / sqrt 2 at the cut-off.
TEST(SmoothLogTest, DerivativesOfPolynomialsAreExact) {
  const Recording r = Timeline(1000, 0.002);
  const SmoothLog smooth(r, {.cutoff_hz = 10});
  std::vector<double> line, parabola, constant(1000, 0.7);
  for (const double t : r.time_s) line.push_back(3 * t + 1), parabola.push_back(2 * t * t - t);
  const auto l0 = smooth.Sampled(line, 0), l1 = smooth.Sampled(line, 1), p1 = smooth.Sampled(parabola, 1),
             p2 = smooth.Sampled(parabola, 2), c2 = smooth.Sampled(constant, 2);
  for (std::size_t i = smooth.reach() + 1; i + smooth.reach() + 1 < 1000; ++i) {
    EXPECT_NEAR(l0[i], line[i], 1e-9);
    EXPECT_NEAR(l1[i], 3, 1e-6);
    EXPECT_NEAR(p1[i], 4 * r.time_s[i] - 1, 1e-6);
    EXPECT_NEAR(p2[i], 4, 1e-4);
    EXPECT_NEAR(c2[i], 0, 1e-9);  // an angle must not look like a spring's torque
  }
  EXPECT_TRUE(std::isnan(l0[0]) && std::isnan(l0[999]));
}

TEST(SmoothLogTest, SineLosesThreeDecibelsAtTheCutoffAndNoPhase) {
  const Recording r = Timeline(4000, 0.002);
  const SmoothLog smooth(r, {.cutoff_hz = 6});
  const double w = 2 * std::numbers::pi * 6;
  std::vector<double> sine;
  for (const double t : r.time_s) sine.push_back(std::sin(w * t));
  const auto s0 = smooth.Sampled(sine, 0), s1 = smooth.Sampled(sine, 1), late = smooth.Sampled(sine, 0, 0.0137);
  for (std::size_t i = 200; i < 3800; ++i) {
    EXPECT_NEAR(s0[i], std::sqrt(0.5) * sine[i], 1e-6);
    EXPECT_NEAR(s1[i], std::sqrt(0.5) * w * std::cos(w * r.time_s[i]), 1e-4);
    EXPECT_NEAR(late[i], std::sqrt(0.5) * std::sin(w * (r.time_s[i] - 0.0137)), 1e-6);
  }
}

// A command that is held to the next row is half a step later than its samples say.
TEST(SmoothLogTest, HeldCommandsAreCentredOnTheirInterval) {
  const Recording r = Timeline(4000, 0.01);
  const SmoothLog smooth(r, {.cutoff_hz = 1});
  std::vector<double> ramp;
  for (const double t : r.time_s) ramp.push_back(t);
  const auto held = smooth.Held(ramp);
  // The staircase's mean lies half a step below the line through its corners.
  for (std::size_t i = 200; i < 3800; ++i) EXPECT_NEAR(held[i], r.time_s[i] - 0.005, 1e-9);
}

TEST(SmoothLogTest, GapsStayGaps) {
  const Recording r = Timeline(1000, 0.002);
  const SmoothLog smooth(r, {.cutoff_hz = 10});
  std::vector<double> values(1000, 1.0);
  values[500] = std::nan("");
  const auto out = smooth.Sampled(values, 0);
  EXPECT_TRUE(std::isnan(out[500 - smooth.reach()]) && std::isnan(out[500 + smooth.reach() - 1]));
  EXPECT_TRUE(std::isfinite(out[500 - smooth.reach() - 2]));
}

}  // namespace
}  // namespace gapscope
