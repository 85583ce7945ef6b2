// Sensors between mechanism and log: low-pass and delay against closed forms.
#include "replay/sensors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <vector>

namespace gapscope {
namespace {

// Stamps of uneven length, as a real log has.
std::vector<double> Stamps(double end) {
  std::vector<double> time = {0};
  while (time.back() < end) time.push_back(time.back() + (time.size() % 3 == 0 ? 0.003 : 0.002));
  return time;
}

TEST(LowPass, StepResponseIsTheClosedForm) {
  const std::vector<double> time = Stamps(2);
  const std::vector<double> in(time.size(), 1.0);
  for (const double z : {0.2, 0.9, 1.0, 1.7}) {
    const LowPassFilter filter{.cutoff_rad_per_s = 12.6, .damping_ratio = z};
    std::vector<double> out(time.size());
    LowPass(time, in, filter, 0, 0, out);
    const std::complex<double> root = std::sqrt(std::complex<double>(z * z - 1)), w = 12.6;
    const std::complex<double> a = -w * (z - root), b = -w * (z + root);
    for (std::size_t k = 0; k < time.size(); ++k) {
      // y = 1 + (b e^(a t) - a e^(b t)) / (a - b), poles a and b; (1 + w t) e^(-w t) where they meet.
      const double t = time[k];
      const double expected = z == 1 ? 1 - (1 + 12.6 * t) * std::exp(-12.6 * t)
                                     : 1 + ((b * std::exp(a * t) - a * std::exp(b * t)) / (a - b)).real();
      ASSERT_NEAR(out[k], expected, 1e-12) << "damping ratio " << z << ", t " << t;
    }
  }
}

TEST(LowPass, SineComesOutWithGainAndPhaseOfTheTransferFunction) {
  const std::vector<double> time = Stamps(6);
  const LowPassFilter filter{.cutoff_rad_per_s = 12.6, .damping_ratio = 0.9};
  const double omega = 2 * M_PI * 1.85;
  const std::complex<double> s(0, omega);
  const std::complex<double> gain = 12.6 * 12.6 / (s * s + 2 * 0.9 * 12.6 * s + 12.6 * 12.6);
  std::vector<double> in(time.size()), out(time.size());
  for (std::size_t k = 0; k < time.size(); ++k) in[k] = std::sin(omega * time[k]);
  LowPass(time, in, filter, 0, 0, out);
  for (std::size_t k = 0; k < time.size(); ++k) {
    if (time[k] < 3) continue;  // the start has died away: e^(-0.9 12.6 3)
    ASSERT_NEAR(out[k], std::abs(gain) * std::sin(omega * time[k] + std::arg(gain)), 2e-4) << time[k];
  }
}

TEST(LowPass, SteadyRampStaysSteady) {
  const std::vector<double> time = Stamps(1);
  std::vector<double> in(time.size()), out(time.size());
  for (std::size_t k = 0; k < time.size(); ++k) in[k] = 2 + 3 * time[k];
  const double lag = 2 * 0.9 / 12.6;
  LowPass(time, in, {.cutoff_rad_per_s = 12.6, .damping_ratio = 0.9}, 2 - 3 * lag, 3, out);
  for (std::size_t k = 0; k < time.size(); ++k) ASSERT_NEAR(out[k], in[k] - 3 * lag, 1e-12);
}

TEST(Delay, ParabolaIsShiftedExactlyOnEvenStamps) {
  std::vector<double> time, in;
  for (int k = 0; k < 200; ++k)
    time.push_back(0.002 * k), in.push_back(1 + 2 * time.back() + 3 * time.back() * time.back());
  std::vector<double> out(time.size());
  Delay(time, in, 0.0071, out);
  for (std::size_t k = 10; k < time.size(); ++k) {
    const double t = time[k] - 0.0071;
    ASSERT_NEAR(out[k], 1 + 2 * t + 3 * t * t, 1e-12);
  }
}

}  // namespace
}  // namespace gapscope
