// MeasureExcitation and MeasureCoverage of inspect_parts.h.
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "src/core/collect.h"
#include "src/core/statistics.h"
#include "src/log/inspect_parts.h"

namespace gapscope {
namespace {

// One-sided power of a signal without its mean, by bins of 1 / (size * step): bin 0 is left out.
struct Spectrum {
  std::vector<double> power;
  double bin_hz = 0;
};
Spectrum PowerSpectrum(const UniformSignal& signal) {
  const std::size_t count = signal.values.size();
  double mean = 0, largest = 0;
  for (std::size_t k = 0; k < count; ++k) mean += (signal.values[k] - mean) / static_cast<double>(k + 1);
  for (const double x : signal.values) largest = std::max(largest, std::abs(x - mean));
  std::size_t size = 1;
  while (size < count) size *= 2;
  std::vector<double> windowed(size, 0);
  for (std::size_t k = 0; k < count && largest > 0; ++k) {
    // Hann's window keeps strong lines from leaking over the bands.
    const double window =
        0.5 - 0.5 * std::cos(2 * std::numbers::pi * (static_cast<double>(k) + 0.5) / static_cast<double>(count));
    windowed[k] = window * (signal.values[k] - mean) / largest;
  }
  Eigen::FFT<double> fft;
  std::vector<std::complex<double>> transform;
  fft.fwd(transform, windowed);
  Spectrum spectrum;
  spectrum.bin_hz = 1 / (static_cast<double>(size) * signal.step_s);
  spectrum.power.resize(size / 2 + 1, 0);
  for (std::size_t k = 1; k < spectrum.power.size(); ++k) spectrum.power[k] = std::norm(transform[k]);
  return spectrum;
}

// Largest |value| of each stretch between crossings of the mean (with a dead band of 5 % of the largest).
std::vector<double> HalfCyclePeaks(const std::vector<double>& values) {
  double mean = 0;
  for (std::size_t k = 0; k < values.size(); ++k) mean += (values[k] - mean) / static_cast<double>(k + 1);
  double largest = 0;
  for (const double x : values) largest = std::max(largest, std::abs(x - mean));
  std::vector<double> peaks;
  int sign = 0;
  double peak = 0;
  for (const double value : values) {
    const double x = value - mean;
    const int now = x > 0.05 * largest ? 1 : x < -0.05 * largest ? -1 : 0;
    if (now != 0 && now != sign) {
      if (sign != 0) peaks.push_back(peak);
      sign = now;
      peak = 0;
    }
    if (now != 0) peak = std::max(peak, std::abs(x));
  }
  if (sign != 0) peaks.push_back(peak);
  return peaks;
}

}  // namespace

CommandExcitation MeasureExcitation(const InspectChannel& command, const std::vector<double>& time_s, double step_s) {
  CommandExcitation result{.name = command.name, .bands = {}};
  const UniformSignal signal = ResampleUniform(time_s, command.values, step_s, true);
  if (signal.values.size() < 4) return result;
  const Spectrum spectrum = PowerSpectrum(signal);
  double total = 0;
  for (const double p : spectrum.power) total += p;
  const double half_rate_hz = 0.5 / signal.step_s;

  // Decades from the lowest that the log is long enough for.
  for (double low = std::pow(10.0, std::floor(std::log10(spectrum.bin_hz))); low < half_rate_hz; low *= 10) {
    result.bands.push_back({low, std::min(low * 10, half_rate_hz), 0});
  }
  double sum = 0, strongest = -1;
  bool below = true;
  for (std::size_t k = 1; k < spectrum.power.size(); ++k) {
    const double hz = static_cast<double>(k) * spectrum.bin_hz;
    const double p = total > 0 ? spectrum.power[k] / total : 0;
    for (std::size_t b = 0; b < result.bands.size(); ++b) {
      if (hz < result.bands[b].high_hz || b + 1 == result.bands.size()) {
        result.bands[b].share += p;
        break;
      }
    }
    if (p > strongest) strongest = p, result.peak_hz = hz;
    sum += p;
    if (below && sum >= 0.95) result.bandwidth_95_hz = hz, below = false;
  }
  const auto [low, high] = std::minmax_element(signal.values.begin(), signal.values.end());
  result.range = *high - *low;
  const std::vector<double> peaks = HalfCyclePeaks(signal.values);
  result.half_cycles = peaks.size();
  const double small = Quantile(peaks, 0.1);
  result.amplitude_ratio = small > 0 ? Quantile(peaks, 0.9) / small : 0;
  return result;
}

MotionCoverage MeasureCoverage(const InspectChannel& channel, const ChannelReport& report,
                               const std::vector<double>& time_s, double step_s) {
  MotionCoverage coverage{.name = channel.name};
  coverage.range = report.maximum - report.minimum;
  const UniformSignal signal = ResampleUniform(time_s, channel.values, step_s, false);
  const std::size_t count = signal.values.size();
  if (count < 4) return coverage;

  // A position is differentiated over about 20 ms; a change below a count and a half, or four times the noise, is none.
  std::vector<double> speed = signal.values;
  double threshold = std::max(1.5 * report.quantisation_step, 4 * report.noise);
  if (IsPositionUnit(channel.unit)) {
    const auto half = std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(0.01 / signal.step_s)));
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t first = k > half ? k - half : 0, last = std::min(count - 1, k + half);
      speed[k] = (signal.values[last] - signal.values[first]) / (static_cast<double>(last - first) * signal.step_s);
    }
    threshold /= 2 * static_cast<double>(half) * signal.step_s;
  }
  coverage.speed_max = Quantile(Collect(speed, [](double v) { return std::abs(v); }), 0.999);
  threshold = std::max(threshold, 0.005 * coverage.speed_max);

  std::size_t moving = 0, slow = 0, positive = 0;
  int direction = 0;
  for (const double v : speed) {
    if (!(std::abs(v) > threshold)) continue;
    ++moving;
    slow += std::abs(v) < 0.1 * coverage.speed_max;
    positive += v > 0;
    const int now = v > 0 ? 1 : -1;
    coverage.reversals += direction != 0 && now != direction;
    direction = now;
  }
  const auto all = static_cast<double>(count);
  coverage.moving_share = static_cast<double>(moving) / all;
  coverage.rest_share = 1 - coverage.moving_share;
  coverage.slow_share = static_cast<double>(slow) / all;
  coverage.positive_share = moving > 0 ? static_cast<double>(positive) / static_cast<double>(moving) : 0;
  return coverage;
}

}  // namespace gapscope
