#include "src/compare/frequency_response.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "src/compare/spectrum.h"

namespace gapscope {
namespace {

using Complex = std::complex<double>;

constexpr std::size_t kLeastRows = 256, kSegments = 8;
constexpr double kLeastPower = 1e-3, kLeastCoherence = 0.5, kBand = 0.2;  // octaves

// Without mean and slope. Of the whole record: taken from each segment, a slope would spread a slow sine over the
// lowest bins.
std::vector<double> Level(std::vector<double> values) {
  const double count = static_cast<double>(values.size()), middle = 0.5 * (count - 1);
  double mean = 0, tilt = 0, spread = 0;
  for (const double v : values) mean += v / count;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double x = static_cast<double>(i) - middle;
    tilt += x * (values[i] - mean);
    spread += x * x;
  }
  for (std::size_t i = 0; i < values.size(); ++i) values[i] -= mean + tilt / spread * (static_cast<double>(i) - middle);
  return values;
}

// The half spectrum of a segment less its mean, under a Hann window.
std::vector<Complex> Transform(Eigen::FFT<double>& fft, std::span<const double> values) {
  const double count = static_cast<double>(values.size());
  double mean = 0;
  for (const double v : values) mean += v / count;
  std::vector<double> windowed(values.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    windowed[i] = (values[i] - mean) * (0.5 - 0.5 * std::cos(2 * std::numbers::pi * static_cast<double>(i) / count));
  std::vector<Complex> spectrum;
  fft.fwd(spectrum, windowed);
  return spectrum;
}

struct Band {
  double hz = 0, uu = 0, yy = 0;
  Complex uy, up;
  int bins = 0;
};

double Unwrapped(double phase_deg, double previous_deg) {
  return phase_deg - 360 * std::round((phase_deg - previous_deg) / 360);
}

}  // namespace

std::vector<ResponsePoint> EstimateResponse(std::span<const double> time_s, std::span<const double> command,
                                            std::span<const double> measured, std::span<const double> predicted) {
  const std::size_t rows = time_s.size();
  std::vector<double> u = FillGaps(command), y = FillGaps(measured), p = FillGaps(predicted);
  if (rows < kLeastRows || u.size() != rows || y.size() != rows || p.size() != rows) return {};
  u = Level(std::move(u)), y = Level(std::move(y)), p = Level(std::move(p));
  const std::size_t segment = std::bit_floor(std::max(kLeastRows / 2, 2 * rows / (kSegments + 1)));
  const double step = MedianStep(time_s);
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  const std::size_t bins = segment / 2 + 1;
  std::vector<Band> sums(bins);
  for (std::size_t begin = 0; begin + segment <= rows; begin += segment / 2) {
    const auto su = Transform(fft, std::span(u).subspan(begin, segment)),
               sy = Transform(fft, std::span(y).subspan(begin, segment)),
               sp = Transform(fft, std::span(p).subspan(begin, segment));
    for (std::size_t k = 0; k < bins; ++k) {
      sums[k].uu += std::norm(su[k]);
      sums[k].yy += std::norm(sy[k]);
      sums[k].uy += std::conj(su[k]) * sy[k];
      sums[k].up += std::conj(su[k]) * sp[k];
    }
  }
  // Bins become bands; coherence is taken of the bins, whose phases differ within a band.
  const double bin_hz = 1 / (static_cast<double>(segment) * step);
  double strongest = 0;
  for (std::size_t k = 1; k < bins; ++k) strongest = std::max(strongest, sums[k].uu);
  if (!(strongest > 0)) return {};
  std::vector<ResponsePoint> points;
  for (std::size_t k = 1; k + 1 < bins;) {
    const std::size_t last =
        std::max(k + 1, static_cast<std::size_t>(std::ceil(static_cast<double>(k) * std::exp2(kBand))));
    Band band;
    double coherence = 0;
    for (; k < std::min(last, bins - 1); ++k) {
      const Band& bin = sums[k];
      band.hz += static_cast<double>(k) * bin_hz * bin.uu;
      band.uu += bin.uu;
      band.uy += bin.uy;
      band.up += bin.up;
      if (bin.uu * bin.yy > 0) coherence += bin.uu * std::norm(bin.uy) / (bin.uu * bin.yy);
      ++band.bins;
    }
    if (!(band.uu / band.bins > kLeastPower * strongest)) continue;
    coherence /= band.uu;
    if (!(coherence >= kLeastCoherence)) continue;
    ResponsePoint point{.hz = band.hz / band.uu,
                        .measured_gain = std::abs(band.uy) / band.uu,
                        .predicted_gain = std::abs(band.up) / band.uu,
                        .coherence = coherence};
    const double m = std::arg(band.uy) * 180 / std::numbers::pi, q = std::arg(band.up) * 180 / std::numbers::pi;
    point.measured_phase_deg = points.empty() ? m : Unwrapped(m, points.back().measured_phase_deg);
    point.predicted_phase_deg = Unwrapped(q, point.measured_phase_deg);
    points.push_back(point);
  }
  return points;
}

}  // namespace gapscope
