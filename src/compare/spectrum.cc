#include "src/compare/spectrum.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "src/core/result.h"
#include "src/core/statistics.h"

namespace gapscope {
namespace {

using Complex = std::complex<double>;
using Fft = Eigen::FFT<double>;

Fft HalfSpectrumFft() {
  Fft fft;
  fft.SetFlag(Fft::HalfSpectrum);
  return fft;
}

// The smallest length >= n, a multiple of 2, whose only factors are 2, 3 and 5: quick to transform.
std::size_t QuickLength(std::size_t n) {
  for (std::size_t length = std::max<std::size_t>(2, n + n % 2);; length += 2) {
    std::size_t rest = length;
    for (const std::size_t factor : {2, 3, 5}) {
      while (rest % factor == 0) rest /= factor;
    }
    if (rest == 1) return length;
  }
}

}  // namespace

double MedianStep(std::span<const double> time_s) {
  if (time_s.size() < 2) return kNaN;
  std::vector<double> steps(time_s.size() - 1);
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i] = time_s[i + 1] - time_s[i];
  return Median(std::move(steps));
}

std::vector<double> FillGaps(std::span<const double> values) {
  std::vector<double> filled(values.begin(), values.end());
  std::size_t previous = values.size();  // last finite row, none yet
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) continue;
    if (previous == values.size()) {
      std::fill(filled.begin(), filled.begin() + static_cast<std::ptrdiff_t>(i), values[i]);
    } else {
      const double slope = (values[i] - values[previous]) / static_cast<double>(i - previous);
      for (std::size_t j = previous + 1; j < i; ++j)
        filled[j] = values[previous] + slope * static_cast<double>(j - previous);
    }
    previous = i;
  }
  if (previous == values.size()) return {};
  std::fill(filled.begin() + static_cast<std::ptrdiff_t>(previous), filled.end(), values[previous]);
  return filled;
}

std::vector<double> CrossCorrelation(std::span<const double> a, std::span<const double> b, std::size_t max_lag) {
  GS_CHECK(a.size() == b.size());
  const std::size_t n = a.size();
  std::vector<double> result(2 * max_lag + 1, 0.0);
  if (n == 0) return result;
  const std::size_t whole = std::bit_ceil(n + 2 * max_lag + 1);
  const std::size_t length =
      std::max<std::size_t>(4, std::min(whole, std::bit_ceil(std::max<std::size_t>(1024, 8 * max_lag))));
  const std::size_t block = length - 2 * max_lag;

  Fft fft = HalfSpectrumFft();
  std::vector<double> wide(length), narrow(length);
  std::vector<Complex> wide_spectrum, narrow_spectrum, sum(length / 2 + 1);
  for (std::size_t start = 0; start < n; start += block) {
    const std::size_t count = std::min(block, n - start);
    std::fill(narrow.begin(), narrow.end(), 0.0);
    std::copy_n(b.begin() + static_cast<std::ptrdiff_t>(start), count, narrow.begin());
    // wide[i] = a[start - max_lag + i]
    for (std::size_t i = 0; i < length; ++i) {
      const std::size_t row = start + i;
      wide[i] = row >= max_lag && row - max_lag < n && i < count + 2 * max_lag ? a[row - max_lag] : 0.0;
    }
    fft.fwd(wide_spectrum, wide);
    fft.fwd(narrow_spectrum, narrow);
    for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += wide_spectrum[k] * std::conj(narrow_spectrum[k]);
  }
  fft.inv(wide, sum, static_cast<Eigen::Index>(length));
  std::copy_n(wide.begin(), result.size(), result.begin());
  return result;
}

BandSplitter::BandSplitter(std::span<const double> values, double step_s) : rows_(values.size()) {
  GS_CHECK(rows_ > 0 && step_s > 0);
  // Mirrored rows fill up to a quick length; then the whole is mirrored.
  const std::size_t half = QuickLength(rows_);
  length_ = 2 * half;
  std::vector<double> mirrored(length_);
  for (std::size_t i = 0; i < half; ++i) {
    std::size_t row = i % (2 * rows_);
    if (row >= rows_) row = 2 * rows_ - 1 - row;
    mirrored[i] = mirrored[length_ - 1 - i] = values[row];
  }
  Fft fft = HalfSpectrumFft();
  std::vector<Complex> spectrum;
  fft.fwd(spectrum, mirrored);
  bin_hz_ = 1 / (static_cast<double>(length_) * step_s);
  power_.resize(spectrum.size());
  real_.resize(spectrum.size());
  imaginary_.resize(spectrum.size());
  const double scale = 1 / (static_cast<double>(length_) * static_cast<double>(length_));
  for (std::size_t k = 0; k < spectrum.size(); ++k) {
    const bool single = k == 0 || k + 1 == spectrum.size();
    power_[k] = std::norm(spectrum[k]) * scale * (single ? 1 : 2);
    real_[k] = spectrum[k].real();
    imaginary_[k] = spectrum[k].imag();
  }
}

std::vector<double> BandSplitter::Part(std::size_t first, std::size_t last) const {
  std::vector<Complex> spectrum(power_.size());
  for (std::size_t k = first; k < std::min(last, spectrum.size()); ++k) spectrum[k] = {real_[k], imaginary_[k]};
  Fft fft = HalfSpectrumFft();
  std::vector<double> part(length_);
  fft.inv(part, spectrum, static_cast<Eigen::Index>(length_));
  part.resize(rows_);
  return part;
}

Spectrum WelchSpectrum(std::span<const double> values, double step_s, std::size_t segment) {
  GS_CHECK(segment >= 4 && std::has_single_bit(segment) && segment <= values.size() && step_s > 0);
  const std::size_t hop = segment / 2;
  const std::size_t count = (values.size() - segment) / hop + 1;
  const double rows = static_cast<double>(segment);

  std::vector<double> window(segment), piece(segment);
  double window_power = 0;
  for (std::size_t i = 0; i < segment; ++i) {
    window[i] = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * (static_cast<double>(i) + 0.5) / rows);
    window_power += window[i] * window[i];
  }

  Fft fft = HalfSpectrumFft();
  std::vector<Complex> spectrum;
  Spectrum result;
  result.density.assign(segment / 2 + 1, 0.0);
  result.bin_hz = 1 / (rows * step_s);
  const double middle = (rows - 1) / 2;
  const double slope_norm = rows * (rows * rows - 1) / 12;  // sum of (i - middle)^2
  for (std::size_t s = 0; s < count; ++s) {
    const std::span<const double> part = values.subspan(s * hop, segment);
    double mean = 0, slope = 0;
    for (std::size_t i = 0; i < segment; ++i) {
      mean += part[i] / rows;
      slope += part[i] * (static_cast<double>(i) - middle) / slope_norm;
    }
    for (std::size_t i = 0; i < segment; ++i) {
      piece[i] = window[i] * (part[i] - mean - slope * (static_cast<double>(i) - middle));
    }
    fft.fwd(spectrum, piece);
    for (std::size_t k = 0; k < result.density.size(); ++k) {
      const bool single = k == 0 || k + 1 == result.density.size();
      result.density[k] +=
          std::norm(spectrum[k]) * (single ? 1 : 2) * step_s / window_power / static_cast<double>(count);
    }
  }
  // Neighbouring Hann periodograms, half overlapping, correlate by 1/36.
  const double k = static_cast<double>(count);
  result.averages = k / (1 + 2 * (1.0 / 36) * (k - 1) / k);
  return result;
}

}  // namespace gapscope
