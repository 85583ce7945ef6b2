// FindDelay of inspect_parts.h.
#include <algorithm>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>

#include "src/log/inspect_parts.h"

namespace gapscope {
namespace {

// The signal without its mean, scaled to at most 1, with zeros behind.
std::vector<double> Padded(const std::vector<double>& values, std::size_t count, std::size_t size) {
  double mean = 0, largest = 0;
  for (std::size_t k = 0; k < count; ++k) mean += (values[k] - mean) / static_cast<double>(k + 1);
  std::vector<double> padded(size, 0);
  for (std::size_t k = 0; k < count; ++k) {
    padded[k] = values[k] - mean;
    largest = std::max(largest, std::abs(padded[k]));
  }
  if (largest > 0 && std::isfinite(largest)) {
    for (double& x : padded) x /= largest;
  }
  return padded;
}

// sums[k]: squares of the first k values.
std::vector<double> RunningEnergy(const std::vector<double>& values) {
  std::vector<double> sums(values.size() + 1, 0);
  for (std::size_t k = 0; k < values.size(); ++k) sums[k + 1] = sums[k] + values[k] * values[k];
  return sums;
}

}  // namespace

BestShift FindDelay(const UniformSignal& x, const UniformSignal& y, double longest_s) {
  BestShift best;
  const std::size_t count = std::min(x.values.size(), y.values.size());
  if (count < 4) return best;
  const std::size_t third = (count - 1) / 3;
  const auto longest = static_cast<std::ptrdiff_t>(std::min(longest_s / x.step_s, static_cast<double>(third)));
  const auto margin = static_cast<std::size_t>(longest);
  std::size_t size = 1;
  while (size < count + margin + 1) size *= 2;
  std::vector<double> a = Padded(x.values, count, size);
  const std::vector<double> b = Padded(y.values, count, size);
  // The same stretch of x at every shift, and y's energy where it lies: otherwise the ends pull the peak towards zero.
  std::fill(a.begin(), a.begin() + longest, 0);
  std::fill(a.begin() + static_cast<std::ptrdiff_t>(count) - longest, a.end(), 0);
  const double energy_x = RunningEnergy(a).back();
  const std::vector<double> energy_y = RunningEnergy(b);
  if (!(energy_x > 0) || !std::isfinite(energy_x) || !std::isfinite(energy_y.back())) return best;

  Eigen::FFT<double> fft;
  std::vector<std::complex<double>> fa, fb;
  fft.fwd(fa, a);
  fft.fwd(fb, b);
  for (std::size_t k = 0; k < fa.size(); ++k) fa[k] = std::conj(fa[k]) * fb[k];
  std::vector<double> r;
  fft.inv(r, fa);

  const auto at = [&](std::ptrdiff_t shift) {
    const auto first = static_cast<std::size_t>(longest + shift);
    const double scale = energy_x * (energy_y[first + count - 2 * margin] - energy_y[first]);
    const auto place =
        static_cast<std::size_t>((shift + static_cast<std::ptrdiff_t>(size)) % static_cast<std::ptrdiff_t>(size));
    // Where y rests its correlation is rounding.
    return scale > 1e-12 * energy_x * energy_y.back() ? r[place] / std::sqrt(scale) : 0.0;
  };
  std::ptrdiff_t peak = 0;
  for (std::ptrdiff_t shift = -longest; shift <= longest; ++shift) {
    if (std::abs(at(shift)) > std::abs(at(peak))) peak = shift;
  }
  best.correlation = at(peak);
  best.shift_s = static_cast<double>(peak) * x.step_s;
  best.at_end = std::abs(peak) == longest;
  if (best.at_end) return best;
  // The top of the parabola through the peak and its neighbours.
  const double left = at(peak - 1), top = at(peak), right = at(peak + 1);
  const double bend = left - 2 * top + right;
  if (bend != 0) {
    const double shift = std::clamp(0.5 * (left - right) / bend, -0.5, 0.5);
    best.shift_s += shift * x.step_s;
    best.correlation = std::clamp(top - 0.25 * (left - right) * shift, -1.0, 1.0);
  }
  return best;
}

}  // namespace gapscope
