// Fourier helpers of the comparison: correlation at limited lags, a signal split into frequency bands, smoothed
// spectra. All take plain rows; none keeps state between calls.
#ifndef GAPSCOPE_COMPARE_SPECTRUM_H_
#define GAPSCOPE_COMPARE_SPECTRUM_H_

#include <cstddef>
#include <span>
#include <vector>

namespace gapscope {

// The middle step of a strictly increasing time axis, s; NaN below two rows.
double MedianStep(std::span<const double> time_s);

// `values` with rows that are not finite replaced by the line between their neighbours (held at the ends).
// Empty when no row is finite.
std::vector<double> FillGaps(std::span<const double> values);

// r[max_lag + l] = sum over i of a[i + l] b[i] for l = -max_lag..max_lag, rows outside the data being zero. Linear, not
// circular. Blocks of `b` are transformed with 2 max_lag more rows of `a` and their products added before one
// inverse transform, so that the cost grows as n log(max_lag). a and b have the same size.
std::vector<double> CrossCorrelation(std::span<const double> a, std::span<const double> b, std::size_t max_lag);

// A signal seen through the cosine basis: the rows, mirrored at their ends, repeat without a jump, so that a trend does
// not leak into high frequencies as it would with a bare Fourier transform. Rows are taken as `step_s` apart.
class BandSplitter {
 public:
  // `values`: at least one row, all finite.
  BandSplitter(std::span<const double> values, double step_s);

  // Bin k lies at k * bin_hz(); bin 0 is the mean.
  double bin_hz() const { return bin_hz_; }
  std::size_t bins() const { return power_.size(); }
  // Mean square that bin k adds to the (mirrored) signal.
  const std::vector<double>& power() const { return power_; }
  // The part of the signal in bins first..last-1, one value per row. The parts of a partition add up to the signal.
  std::vector<double> Part(std::size_t first, std::size_t last) const;

 private:
  std::size_t rows_ = 0, length_ = 0;
  double bin_hz_ = 0;
  std::vector<double> real_, imaginary_;  // half spectrum of the mirrored rows
  std::vector<double> power_;
};

// Welch's averaged periodogram: Hann windows of `segment` rows (a power of two) overlapping by half, each less its mean
// and slope. density[k] is one-sided, in squared units per Hz, at k / (segment * step_s); white noise of variance v has
// density 2 v step_s throughout.
struct Spectrum {
  std::vector<double> density;
  double bin_hz = 0;
  double averages = 0;  // effective number of independent periodograms in each bin
};
Spectrum WelchSpectrum(std::span<const double> values, double step_s, std::size_t segment);

}  // namespace gapscope

#endif  // GAPSCOPE_COMPARE_SPECTRUM_H_
