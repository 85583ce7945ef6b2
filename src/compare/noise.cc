#include "src/compare/noise.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "src/compare/spectrum.h"
#include "src/core/result.h"
#include "src/core/statistics.h"

namespace gapscope {
namespace {

constexpr std::size_t kFewestRowsForNoise = 64;
constexpr std::size_t kLongestSegment = 4096;
constexpr double kHannWidth = 1.5;        // bins that one Hann bin covers
constexpr double kTopOfNyquist = 0.95;    // anti-alias filters and the last bin stay out
constexpr double kStartOfNyquist = 0.45;  // taken as free of motion
constexpr double kCoarseRise = 1.25;      // a band may lie this much above what was foretold ...
constexpr double kNoiseRise = 3;          // ... plus this many of its own standard deviations
constexpr double kColouredGain = 9;       // twice the log-likelihood, for two more parameters

// A quarter octave of the spectrum.
struct NoiseBand {
  double low_hz, high_hz;   // first and last bin
  std::size_t first, last;  // bins first..last-1
  double density;           // mean over the bins
  double averages;          // independent periodograms behind it
};

// density = white + coloured * shape(tau), `white` and `coloured` densities at frequency zero.
struct Fit {
  double white = 0, coloured = 0, tau_s = kNaN;
  double cost = kInfinity;  // -2 log-likelihood, up to a constant
};

// AR(1) sampled at dt, relative to frequency zero.
double Shape(double frequency_hz, double tau_s, double dt_s) {
  const double phi = std::exp(-dt_s / tau_s);
  return (1 - phi) * (1 - phi) / (1 - 2 * phi * std::cos(2 * std::numbers::pi * frequency_hz * dt_s) + phi * phi);
}

std::vector<NoiseBand> MakeBands(const Spectrum& spectrum, double lowest_hz) {
  std::vector<NoiseBand> bands;
  const double nyquist_hz = spectrum.bin_hz * static_cast<double>(spectrum.density.size() - 1);
  const auto end = static_cast<std::size_t>(kTopOfNyquist * nyquist_hz / spectrum.bin_hz) + 1;
  // Bins 0 and 1 hold what is left of mean and slope.
  auto first = std::max<std::size_t>(
      2, static_cast<std::size_t>(std::ceil(std::min(lowest_hz, 2 * nyquist_hz) / spectrum.bin_hz)));
  while (first < end) {
    const auto wide = static_cast<std::size_t>(static_cast<double>(first) * std::exp2(0.25));
    const std::size_t last = std::min(end, std::max(first + 1, wide));
    NoiseBand band{.low_hz = static_cast<double>(first) * spectrum.bin_hz,
                   .high_hz = static_cast<double>(last - 1) * spectrum.bin_hz,
                   .first = first,
                   .last = last,
                   .density = 0,
                   .averages = 0};
    const double bins = static_cast<double>(last - first);
    for (std::size_t k = first; k < last; ++k) band.density += spectrum.density[k] / bins;
    band.averages = spectrum.averages * std::max(1.0, bins / kHannWidth);
    bands.push_back(band);
    first = last;
  }
  return bands;
}

class DensityFitter {
 public:
  DensityFitter(std::vector<NoiseBand> bands, double dt_s) : bands_(std::move(bands)), dt_s_(dt_s) {}

  // Best white plus coloured density for bands first..end, correlated no longer than `slowest_s`.
  Fit Best(std::size_t first, double slowest_s) const {
    Fit best = White(first);
    const double white_cost = best.cost;
    // Faster than 1.5 steps cannot be told from white.
    for (double tau_s = slowest_s; tau_s > 1.5 * dt_s_; tau_s /= std::numbers::sqrt2) {
      const Fit fit = Coloured(first, tau_s);
      if (fit.coloured > 0 && fit.cost < white_cost - kColouredGain && fit.cost < best.cost) best = fit;
    }
    return best;
  }

  double Density(const Fit& fit, const NoiseBand& band) const {
    return fit.white + (fit.coloured > 0 ? fit.coloured * MeanShape(band, fit.tau_s) : 0);
  }

  const std::vector<NoiseBand>& bands() const { return bands_; }

  // The slowest noise whose corner lies within bands first..end.
  double SlowestSeen(std::size_t first) const {
    return std::max(4 * dt_s_, 1 / (2 * std::numbers::pi * bands_[first].low_hz));
  }

 private:
  double MeanShape(const NoiseBand& band, double tau_s) const {
    return (Shape(band.low_hz, tau_s, dt_s_) + 4 * Shape((band.low_hz + band.high_hz) / 2, tau_s, dt_s_) +
            Shape(band.high_hz, tau_s, dt_s_)) /
           6;
  }

  double Cost(std::size_t first, const std::vector<double>& model) const {
    double cost = 0;
    for (std::size_t b = first; b < bands_.size(); ++b) {
      const double m = model[b - first];
      if (!(m > 0)) return kInfinity;
      cost += 2 * bands_[b].averages * (bands_[b].density / m + std::log(m));
    }
    return cost;
  }

  Fit White(std::size_t first) const {
    double sum = 0, weight = 0;
    for (std::size_t b = first; b < bands_.size(); ++b) {
      sum += bands_[b].averages * bands_[b].density;
      weight += bands_[b].averages;
    }
    Fit fit{.white = sum / weight};
    fit.cost = Cost(first, std::vector<double>(bands_.size() - first, fit.white));
    return fit;
  }

  // Non-negative least squares in (white, coloured), weighted anew by 1 / model^2: the likelihood's own equations.
  Fit Coloured(std::size_t first, double tau_s) const {
    const std::size_t n = bands_.size() - first;
    std::vector<double> shape(n), model(n);
    for (std::size_t i = 0; i < n; ++i) {
      shape[i] = MeanShape(bands_[first + i], tau_s);
      model[i] = bands_[first + i].density;
    }
    Fit best;
    for (int round = 0; round < 12; ++round) {
      double a11 = 0, a12 = 0, a22 = 0, b1 = 0, b2 = 0;
      for (std::size_t i = 0; i < n; ++i) {
        const double weight = bands_[first + i].averages / (model[i] * model[i]);
        a11 += weight;
        a12 += weight * shape[i];
        a22 += weight * shape[i] * shape[i];
        b1 += weight * bands_[first + i].density;
        b2 += weight * shape[i] * bands_[first + i].density;
      }
      const double determinant = a11 * a22 - a12 * a12;
      if (!(determinant > 1e-12 * a11 * a22)) break;
      Fit fit{.white = (a22 * b1 - a12 * b2) / determinant,
              .coloured = (a11 * b2 - a12 * b1) / determinant,
              .tau_s = tau_s};
      if (fit.white < 0) fit = {.white = 0, .coloured = b2 / a22, .tau_s = tau_s};
      if (fit.coloured < 0) fit = {.white = b1 / a11, .coloured = 0, .tau_s = tau_s};
      for (std::size_t i = 0; i < n; ++i) model[i] = fit.white + fit.coloured * shape[i];
      fit.cost = Cost(first, model);
      if (fit.cost < best.cost) best = fit;
    }
    return best;
  }

  std::vector<NoiseBand> bands_;
  double dt_s_;
};

// The lowest band without motion. What is foretold may rise all the way down as slow noise does.
std::size_t LowestNoiseBand(const DensityFitter& fitter, std::size_t start) {
  std::size_t first = start;
  while (first > 0) {
    const NoiseBand& next = fitter.bands()[first - 1];
    const double foretold = fitter.Density(fitter.Best(first, fitter.SlowestSeen(0)), next);
    if (next.density > foretold * (kCoarseRise + kNoiseRise / std::sqrt(next.averages))) {
      // The motion's foot may reach into the band just taken.
      return first < start ? first + 1 : first;
    }
    --first;
  }
  return first;
}

// The rows that have a value, where they are an axis of their own (a sensor that is slower than the log): a line drawn
// between them would pass for a quiet sensor. Gaps in one axis are not.
struct OwnRows {
  std::vector<double> time_s, values;
};
std::optional<OwnRows> RowsOfItsOwn(std::span<const double> time_s, std::span<const double> values) {
  constexpr double kSlower = 1.5;
  OwnRows own;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) continue;
    own.time_s.push_back(time_s[i]);
    own.values.push_back(values[i]);
  }
  if (own.values.size() == values.size() || own.values.size() < 2 ||
      MedianStep(own.time_s) < kSlower * MedianStep(time_s))
    return std::nullopt;
  return own;
}

}  // namespace

NoiseFloor EstimateNoise(std::span<const double> time_s, std::span<const double> values, const NoiseOptions& options) {
  GS_CHECK(time_s.size() == values.size() && options.resolution >= 0 && options.motion_band_hz >= 0);
  if (const auto own = RowsOfItsOwn(time_s, values)) return EstimateNoise(own->time_s, own->values, options);
  NoiseFloor floor{.white_std = kNaN,
                   .coloured_std = kNaN,
                   .correlation_time_s = kNaN,
                   .quantisation_std = options.resolution / std::sqrt(12.0),
                   .total_std = kNaN,
                   .band_low_hz = kNaN,
                   .band_high_hz = kNaN};
  const auto finite = std::count_if(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  if (static_cast<std::size_t>(finite) < kFewestRowsForNoise) return floor;
  const std::vector<double> filled = FillGaps(values);
  const double dt_s = MedianStep(time_s);
  GS_CHECK(dt_s > 0);

  const std::size_t segment = std::clamp(std::bit_floor(filled.size() / 4), std::size_t{32}, kLongestSegment);
  const Spectrum spectrum = WelchSpectrum(filled, dt_s, segment);
  std::vector<NoiseBand> bands = MakeBands(spectrum, options.motion_band_hz);
  if (bands.size() < 2) return floor;
  floor.band_high_hz = bands.back().high_hz;
  const auto [low, high] = std::minmax_element(filled.begin(), filled.end());
  if (*low == *high) {
    // A signal that does not change has no noise but the sensor's steps.
    floor.white_std = floor.coloured_std = 0;
    floor.total_std = floor.quantisation_std;
    floor.band_low_hz = bands.front().low_hz;
    return floor;
  }
  // An exactly empty band has no logarithm.
  double highest = 0;
  for (const NoiseBand& band : bands) highest = std::max(highest, band.density);
  for (NoiseBand& band : bands) band.density = std::max(band.density, 1e-30 * highest);

  const DensityFitter fitter(std::move(bands), dt_s);
  std::size_t first = 0;
  if (options.motion_band_hz == 0) {
    const double nyquist_hz = 0.5 / dt_s;
    std::size_t start = 0;
    while (start + 2 < fitter.bands().size() && fitter.bands()[start].low_hz < kStartOfNyquist * nyquist_hz) ++start;
    first = LowestNoiseBand(fitter, start);
  }
  const Fit fit = fitter.Best(first, fitter.SlowestSeen(first));
  floor.band_low_hz = fitter.bands()[first].low_hz;
  floor.white_std = std::sqrt(fit.white / (2 * dt_s));
  floor.coloured_std = 0;
  if (fit.coloured > 0) {
    // Density at frequency zero of an AR(1): 2 dt variance (1 + phi) / (1 - phi).
    const double phi = std::exp(-dt_s / fit.tau_s);
    floor.coloured_std = std::sqrt(fit.coloured / (2 * dt_s) * (1 - phi) / (1 + phi));
    floor.correlation_time_s = fit.tau_s;
  }
  floor.total_std = std::max(std::hypot(floor.white_std, floor.coloured_std), floor.quantisation_std);
  return floor;
}

double SensorNoise(std::span<const double> time_s, std::span<const double> values, double resolution) {
  const double total = EstimateNoise(time_s, values, {.resolution = resolution}).total_std;
  return std::max(std::isfinite(total) ? total : resolution, 1e-3 * MomentsOf(values).deviation);
}

double CorrelationTime(std::span<const double> residual, double dt_s) {
  GS_CHECK(dt_s > 0);
  const auto finite = std::count_if(residual.begin(), residual.end(), [](double v) { return std::isfinite(v); });
  if (finite < 4) return kNaN;
  std::vector<double> values = FillGaps(residual);
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  if (*low == *high) return kNaN;
  const std::size_t n = values.size();
  double mean = 0;
  for (const double value : values) mean += value / static_cast<double>(n);
  for (double& value : values) value -= mean;

  // Most residuals need few lags; more are taken only when the sequence has not ended.
  const std::size_t most = n - 1;
  for (std::size_t lags = std::min<std::size_t>(most, 255);; lags = std::min(most, 4 * lags + 3)) {
    const std::vector<double> correlation = CrossCorrelation(values, values, lags);
    double sum = 0, previous = kInfinity;
    bool ended = false;
    for (std::size_t k = 0; k + 1 <= lags && !ended; k += 2) {
      const double pair = (correlation[lags + k] + correlation[lags + k + 1]) / correlation[lags];
      ended = pair <= 0;
      if (!ended) sum += previous = std::min(previous, pair);
    }
    if (ended || lags == most) return dt_s * std::max(1.0, 2 * sum - 1);
  }
}

double EffectiveSamples(std::size_t n, double rho) {
  if (n == 0 || !(std::abs(rho) <= 1)) return kNaN;
  const double count = static_cast<double>(n);
  return rho <= 0 ? count : std::clamp(count * (1 - rho) / (1 + rho), 1.0, count);
}

}  // namespace gapscope
