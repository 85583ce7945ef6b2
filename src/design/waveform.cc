#include "src/design/waveform.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace gapscope {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kMostRows = 1e7;
constexpr int kMostLines = 24;

std::vector<double> Multisine(const Waveform& wave, std::size_t rows, double rate_hz) {
  std::vector<double> lines;  // cycles per duration
  const int count = std::clamp(static_cast<int>((wave.high_hz - wave.low_hz) * wave.duration_s) + 1, 1, kMostLines);
  for (int i = 0; i < count; ++i) {
    const double hz =
        wave.low_hz * std::pow(wave.high_hz / wave.low_hz, count > 1 ? static_cast<double>(i) / (count - 1) : 0);
    const double cycles = std::max(1.0, std::round(hz * wave.duration_s));
    if (lines.empty() || cycles > lines.back()) lines.push_back(cycles);
  }
  // Line i passes at the share i / n of the duration: its group delay, and the phase is minus the integral of that over
  // the frequency. For evenly spaced lines these are Schroeder's phases.
  std::vector<double> phases(lines.size(), 0.0);
  for (std::size_t i = 1; i < lines.size(); ++i)
    phases[i] = phases[i - 1] -
                2 * kPi * static_cast<double>(i) / static_cast<double>(lines.size()) * (lines[i] - lines[i - 1]);
  std::vector<double> values(rows, 0.0);
  double peak = 0;
  for (std::size_t k = 0; k < rows; ++k) {
    const double t = static_cast<double>(k) / rate_hz;
    for (std::size_t i = 0; i < lines.size(); ++i)
      values[k] += std::sin(2 * kPi * lines[i] * t / wave.duration_s + phases[i]);
    values[k] *= std::min(1.0, t / (0.1 * wave.duration_s));
    peak = std::max(peak, std::abs(values[k]));
  }
  for (double& value : values) value /= peak;
  return values;
}

std::vector<double> Steps(const Waveform& wave, std::size_t rows, double rate_hz) {
  std::mt19937_64 random(wave.seed);
  const auto even = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::vector<double> values(rows, 0.0);
  const double begin = 0.1 * wave.duration_s, end = 0.9 * wave.duration_s, hold = 1 / (2 * wave.low_hz);
  double t = begin, sign = 1;
  while (t < end) {
    const double until = std::min(end, t + hold * (0.5 + even())), level = sign * (0.3 + 0.7 * even());
    for (std::size_t k = static_cast<std::size_t>(std::ceil(t * rate_hz - 1e-9));
         k < rows && static_cast<double>(k) / rate_hz < until - 1e-12; ++k)
      values[k] = level;
    t = until;
    sign = -sign;
  }
  double peak = 0;
  for (const double value : values) peak = std::max(peak, std::abs(value));
  for (double& value : values) value /= peak > 0 ? peak : 1;
  return values;
}

Result<std::vector<double>> Mirrored(Waveform wave, std::size_t rows, double rate_hz) {
  wave.mirrored = false;
  wave.duration_s /= 2;
  GS_ASSIGN(std::vector<double> values, SampleWaveform(wave, rate_hz));
  const std::size_t half = values.size();
  values.resize(rows);
  for (std::size_t k = half; k < rows; ++k) values[k] = k - half + 1 < half ? -values[k - half + 1] : 0;
  return values;
}

}  // namespace

template <>
std::span<const EnumName<WaveShape>> EnumNames<WaveShape>() {
  static constexpr EnumName<WaveShape> kNames[] = {{WaveShape::kChirp, "chirp"},
                                                   {WaveShape::kSteps, "steps"},
                                                   {WaveShape::kTriangle, "triangle"},
                                                   {WaveShape::kMultisine, "multisine"},
                                                   {WaveShape::kSquare, "square"}};
  return kNames;
}

Result<std::vector<double>> SampleWaveform(const Waveform& wave, double rate_hz) {
  for (const auto& [value, name] : {std::pair{wave.duration_s, "--duration"},
                                    {rate_hz, "--rate"},
                                    {wave.low_hz, "the lowest frequency"},
                                    {wave.high_hz, "the highest frequency"}}) {
    if (!(std::isfinite(value) && value > 0))
      return Error{.what = "not a finite number above zero", .where = name, .actual = std::to_string(value)};
  }
  if (wave.duration_s * rate_hz > kMostRows || wave.duration_s * rate_hz < 8) {
    return Error{.what = "duration times rate gives too many or too few rows",
                 .where = "--duration, --rate",
                 .actual = std::to_string(wave.duration_s * rate_hz),
                 .allowed = "8 to 10 million"};
  }
  const bool band = wave.shape == WaveShape::kChirp || wave.shape == WaveShape::kMultisine;
  const double top = band ? std::max(wave.low_hz, wave.high_hz) : wave.low_hz;
  if (top > rate_hz / 4) {
    return Error{.what = "the highest frequency has fewer than four samples a period",
                 .where = "--rate",
                 .actual = std::to_string(rate_hz) + " Hz for " + std::to_string(top) + " Hz",
                 .allowed = "at least " + std::to_string(4 * top) + " Hz"};
  }
  if (wave.shape == WaveShape::kMultisine && wave.high_hz < wave.low_hz)
    return Error{.what = "the band of the multisine is empty", .where = "--low-hz, --high-hz"};
  const std::size_t rows = static_cast<std::size_t>(std::floor(wave.duration_s * rate_hz + 1e-9)) + 1;
  if (wave.mirrored) return Mirrored(wave, rows, rate_hz);
  switch (wave.shape) {
    case WaveShape::kMultisine:
      return Multisine(wave, rows, rate_hz);
    case WaveShape::kSteps:
      return Steps(wave, rows, rate_hz);
    default:
      break;
  }
  std::vector<double> values(rows);
  for (std::size_t k = 0; k < rows; ++k) {
    const double t = static_cast<double>(k) / rate_hz;
    if (wave.shape == WaveShape::kChirp) {
      values[k] = std::sin(2 * kPi * (wave.low_hz * t + (wave.high_hz - wave.low_hz) / (2 * wave.duration_s) * t * t));
      continue;
    }
    const double turns = wave.low_hz * t + 1e-12, x = turns - std::floor(turns);
    values[k] = wave.shape == WaveShape::kSquare ? (x < 0.5 ? 1.0 : -1.0)
                : x < 0.25                       ? 4 * x
                : x < 0.75                       ? 2 - 4 * x
                                                 : 4 * x - 4;
  }
  return values;
}

}  // namespace gapscope
