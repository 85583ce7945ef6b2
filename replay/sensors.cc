#include "replay/sensors.h"

#include <algorithm>
#include <cmath>

namespace gapscope {

void Delay(std::span<const double> time, std::span<const double> in, double delay_s, std::span<double> out) {
  const std::size_t rows = in.size();
  const auto slope = [&](std::size_t k) {
    const std::size_t a = k > 0 ? k - 1 : 0, b = std::min(k + 1, rows - 1);
    return (in[b] - in[a]) / (time[b] - time[a]);
  };
  std::size_t k = 0;
  for (std::size_t r = 0; r < rows; ++r) {
    const double t = time[r] - delay_s;
    if (t <= time[0]) {
      out[r] = in[0] + slope(0) * (t - time[0]);
      continue;
    }
    while (k + 2 < rows && time[k + 1] <= t) ++k;
    while (k > 0 && time[k] > t) --k;
    const double h = time[k + 1] - time[k], x = (t - time[k]) / h;
    const double a = in[k], b = in[k + 1], da = h * slope(k), db = h * slope(k + 1);
    out[r] = a + x * (da + x * (3 * (b - a) - 2 * da - db + x * (2 * (a - b) + da + db)));
  }
}

void LowPass(std::span<const double> time, std::span<const double> in, const LowPassFilter& filter, double value,
             double slope, std::span<double> out) {
  const double w = filter.cutoff_rad_per_s, z = filter.damping_ratio, lag = 2 * z / w;
  double y = value, dy = slope;
  out[0] = y;
  for (std::size_t k = 1; k < in.size(); ++k) {
    const double h = time[k] - time[k - 1], ramp = (in[k] - in[k - 1]) / h;
    // e = y less the answer to the ramp obeys the homogeneous equation: e(h) = exp(A h) e(0), A = [0 1; -w^2 -2 z w].
    const double e = y - (in[k - 1] - lag * ramp), de = dy - ramp;
    const double detuned = w * w * (1 - z * z), root = std::sqrt(std::abs(detuned));
    const double c = detuned > 0 ? std::cos(root * h) : std::cosh(root * h);
    const double s = root * h < 1e-6 ? h : (detuned > 0 ? std::sin(root * h) : std::sinh(root * h)) / root;
    const double decay = std::exp(-z * w * h);
    y = in[k] - lag * ramp + decay * (c * e + s * (de + z * w * e));
    dy = ramp + decay * (c * de - s * (w * w * e + z * w * de));
    out[k] = y;
  }
}

}  // namespace gapscope
