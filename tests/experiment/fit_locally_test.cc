// The initial state of a replay: value and slope of a measured signal by a local fit.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "src/experiment/local_fit.h"

namespace gapscope::testing {
namespace {

constexpr double kHalfWidth_s = 0.02;

template <class F>
Recording Sampled(int rows, double step_s, F&& f, double resolution = 0) {
  Recording recording;
  Recording::Measured measured;
  measured.spec.resolution = resolution;
  for (int k = 0; k < rows; ++k) {
    recording.time_s.push_back(k * step_s);
    const double y = f(k * step_s);
    measured.values.push_back(resolution > 0 ? resolution * std::round(y / resolution) : y);
  }
  recording.measured.push_back(std::move(measured));
  return recording;
}

LocalFit Fit(const Recording& r, std::size_t row) { return FitLocally(r, r.measured[0], row, kHalfWidth_s); }

TEST(FitLocallyTest, AParabolaIsExactEverywhere) {
  const auto y = [](double t) { return 1 - 2 * t + 3 * t * t; };
  const Recording r = Sampled(200, 0.002, y);
  for (const std::size_t row : {std::size_t{0}, std::size_t{1}, std::size_t{5}, std::size_t{100}, std::size_t{199}}) {
    const double t = r.time_s[row];
    const LocalFit fit = Fit(r, row);
    EXPECT_NEAR(fit.value, y(t), 1e-12) << row;
    EXPECT_NEAR(fit.slope, -2 + 6 * t, 1e-9) << row;
  }
}

// A sensor of 1e-4 rad on a swing of 10 Hz, whose slope a parabola over 40 ms reads 16 % too small, at many phases.
// Rests that are allowed: of a fifth power over 40 ms, (2 pi 10 0.02)^6 / 7! of the swing, and the noise.
TEST(FitLocallyTest, FollowsAFastSwing) {
  constexpr double kSwing = 0.05, kNoise = 1e-4;
  const double w = 2 * M_PI * 10;
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0, kNoise);
  for (const double step_s : {0.001, 0.002, 0.004}) {
    const Recording r = Sampled(static_cast<int>(1 / step_s), step_s,
                                [&](double t) { return kSwing * std::sin(w * t) + normal(random); });
    const auto reach = static_cast<std::size_t>(kHalfWidth_s / step_s);
    for (std::size_t row = reach; row + reach < r.rows(); row += 7) {
      const LocalFit fit = Fit(r, row);
      EXPECT_NEAR(fit.value, kSwing * std::sin(w * r.time_s[row]), 5 * kNoise) << step_s << " " << row;
      EXPECT_NEAR(fit.slope, kSwing * w * std::cos(w * r.time_s[row]), 0.02 * kSwing * w) << step_s << " " << row;
    }
  }
}

// Higher powers only where they say something: noise alone brings a slope farther than four standard errors of a
// parabola's, which are sigma over the root of the squared times, once in a hundred at most.
TEST(FitLocallyTest, DoesNotFollowNoise) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> noise(0, 1e-3);
  constexpr int kTrials = 2000;
  int far = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Recording r = Sampled(60, 0.002, [&](double t) { return 3 * t + noise(random); });
    far += std::abs(Fit(r, 30).slope - 3) > 4 * 1e-3 / (2e-3 * std::sqrt(770.0));
  }
  EXPECT_LE(far, kTrials / 100);
}

// An encoder's counts are no high power: the slope of a parabola's motion is off by at most half a count times
// sum |t| / sum t^2 over the eleven samples, whatever the phase.
TEST(FitLocallyTest, FewCountsAreNoCurve) {
  constexpr double kCount = 2 * M_PI / 2048, kStep_s = 0.004, kFarthest = kCount / 2 * 30 / (110 * kStep_s);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> phase(0, 1), speed(-2, 2), acceleration(-10, 10);
  for (int trial = 0; trial < 5000; ++trial) {
    const double q = phase(random), v = speed(random), a = acceleration(random), at = 10 * kStep_s;
    const Recording r =
        Sampled(21, kStep_s, [&](double t) { return q + v * (t - at) + a * (t - at) * (t - at) / 2; }, kCount);
    const double slope = Fit(r, 10).slope;
    EXPECT_NEAR(slope, v, slope == 0 ? 2 * kFarthest : kFarthest) << q << " " << v << " " << a;
  }
}

TEST(FitLocallyTest, IrregularStampsChangeNothing) {
  Recording r = Sampled(60, 0.002, [](double) { return 0.0; });
  double t = 0;
  for (std::size_t k = 0; k < r.rows(); ++k) {
    r.time_s[k] = t;
    r.measured[0].values[k] = 0.5 + t - 4 * t * t;
    t += k % 3 == 0 ? 0.0031 : 0.0007;
  }
  const LocalFit fit = Fit(r, 20);
  EXPECT_NEAR(fit.value, 0.5 + r.time_s[20] - 4 * r.time_s[20] * r.time_s[20], 1e-12);
  EXPECT_NEAR(fit.slope, 1 - 8 * r.time_s[20], 1e-9);
}

// A sensor slower than its log: two of three rows are missing, the row itself among them.
TEST(FitLocallyTest, MissingValuesChangeNothing) {
  const auto y = [](double t) { return 1 - 2 * t + 3 * t * t; };
  Recording r = Sampled(200, 0.002, y);
  for (std::size_t k = 0; k < r.rows(); ++k) {
    if (k % 3 != 0) r.measured[0].values[k] = std::nan("");
  }
  for (const std::size_t row : {std::size_t{0}, std::size_t{1}, std::size_t{100}, std::size_t{199}}) {
    const double t = r.time_s[row];
    EXPECT_NEAR(Fit(r, row).value, y(t), 1e-12) << row;
    EXPECT_NEAR(Fit(r, row).slope, -2 + 6 * t, 1e-9) << row;
  }
  Recording still = Sampled(200, 0.002, [](double t) { return t > 0.012 ? 20 * (t - 0.012) * (t - 0.012) : 0; }, 1e-3);
  still.measured[0].values[1] = std::nan("");
  EXPECT_EQ(Fit(still, 0).slope, 0);
}

TEST(FitLocallyTest, ALogThatBeginsAtRestStartsAtRest) {
  // Still for 12 ms, then off with 40 rad/s^2.
  const Recording r =
      Sampled(200, 0.002, [](double t) { return 0.3 + (t > 0.012 ? 20 * (t - 0.012) * (t - 0.012) : 0); }, 1e-3);
  const LocalFit fit = Fit(r, 0);
  EXPECT_EQ(fit.value, r.measured[0].values[0]);
  EXPECT_EQ(fit.slope, 0);
}

TEST(FitLocallyTest, AStepThroughALagAtTheFirstStampStartsAtRest) {
  // x''' = 400 / 0.05 / s^3 from rest, exact to the last bit: the parabola through +20 ms sees a slope of -0.3 rad/s
  // there.
  const auto cube = [](double t) { return 0.1 + 400 / 0.05 * t * t * t / 6; };
  const LocalFit fit = Fit(Sampled(200, 0.002, cube), 0);
  EXPECT_EQ(fit.value, 0.1);
  EXPECT_EQ(fit.slope, 0);
  EXPECT_NEAR(Fit(Sampled(200, 0.002, [&](double t) { return cube(t) + 5 * t; }), 0).slope, 5, 0.35);
}

TEST(FitLocallyTest, NoiseWithoutMotionGivesMostlyRest) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 1e-3);
  int moving = 0;
  constexpr int kTrials = 400;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Recording r = Sampled(60, 0.002, [&](double) { return 0.2 + noise(random); });
    const LocalFit fit = Fit(r, 30);
    moving += fit.slope != 0;
    EXPECT_NEAR(fit.value, 0.2, 5e-3);
  }
  // Two standard errors: about one in twenty.
  EXPECT_LT(moving, kTrials / 10);
  EXPECT_GT(moving, 0);
}

TEST(FitLocallyTest, TheSlopeOfANoisyRampIsUnbiased) {
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0, 1e-3);
  double sum = 0;
  constexpr int kTrials = 300;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Recording r = Sampled(60, 0.002, [&](double t) { return 3 * t + noise(random); });
    sum += Fit(r, 30).slope;
  }
  // 21 samples 2 ms apart: the slope's standard error is sigma / sqrt(sum t^2) = 1e-3 / (2e-3 sqrt(770)).
  const double standard_error = 1e-3 / (2e-3 * std::sqrt(770.0));
  EXPECT_NEAR(sum / kTrials, 3, 4 * standard_error / std::sqrt(kTrials));
}

TEST(FitLocallyTest, AQuantisedRampMoves) {
  const Recording r = Sampled(60, 0.002, [](double t) { return 2 * t; }, 0.00307);
  const LocalFit fit = Fit(r, 30);
  EXPECT_NEAR(fit.slope, 2, 0.15);
  EXPECT_NEAR(fit.value, 2 * r.time_s[30], 0.00307);
}

// One count in 40 ms looks like a cubic, and is none: through its step a line has 3/2 of the slope, a cubic 45/16.
TEST(FitLocallyTest, CountsAreNoCurve) {
  constexpr double kCount = 0.002;
  const Recording r = Sampled(400, 0.001, [](double t) { return 0.05 * t; }, kCount);
  for (std::size_t row = 30; row < 370; ++row) EXPECT_LE(Fit(r, row).slope, 1.6 * kCount / (2 * kHalfWidth_s)) << row;
}

TEST(FitLocallyTest, MissingSamplesAreLeftOut) {
  Recording r = Sampled(60, 0.002, [](double t) { return 1 + 2 * t; });
  for (const std::size_t k : {25u, 28u, 30u, 33u}) r.measured[0].values[k] = NAN;
  const LocalFit fit = Fit(r, 30);
  EXPECT_NEAR(fit.value, 1 + 2 * r.time_s[30], 1e-12);
  EXPECT_NEAR(fit.slope, 2, 1e-9);
  for (double& y : r.measured[0].values) y = NAN;
  EXPECT_EQ(Fit(r, 30).value, 0);
  EXPECT_EQ(Fit(r, 0).slope, 0);
}

TEST(FitLocallyTest, AMissingFirstSampleAtRestIsNotNan) {
  Recording r = Sampled(60, 0.002, [](double) { return 0.7; });
  r.measured[0].values[0] = NAN;
  EXPECT_NEAR(Fit(r, 0).value, 0.7, 1e-9);
}

TEST(FitLocallyTest, FewRowsAndSlowSampling) {
  for (const int rows : {2, 3, 4, 7}) {
    const Recording r = Sampled(rows, 0.5, [](double t) { return 1 + t; });
    for (std::size_t row = 0; row < r.rows(); ++row) {
      const LocalFit fit = Fit(r, row);
      EXPECT_TRUE(std::isfinite(fit.value) && std::isfinite(fit.slope));
      EXPECT_NEAR(fit.value, 1 + r.time_s[row], 1e-9) << rows << " " << row;
    }
  }
}

}  // namespace
}  // namespace gapscope::testing
