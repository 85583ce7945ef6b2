// What a sensor adds to a signal, read off the signal itself: a mechanism moves slowly, so whatever is left in the
// spectrum above its band of motion is noise. Also how many independent samples a correlated residual amounts to.
#ifndef GAPSCOPE_COMPARE_NOISE_H_
#define GAPSCOPE_COMPARE_NOISE_H_

#include <cstddef>
#include <span>

namespace gapscope {

struct NoiseOptions {
  double resolution = 0;      // sensor's step in the signal's unit; 0: unknown
  double motion_band_hz = 0;  // noise is sought above this frequency; 0: found from the spectrum
};

// Standard deviations in the signal's unit. NaN where the signal is too short to tell (below 64 rows).
struct NoiseFloor {
  double white_std = 0;     // equal at all frequencies; holds the quantisation of a signal that moves by many steps
  double coloured_std = 0;  // first-order (Ornstein-Uhlenbeck) part; 0 when the spectrum does not ask for one
  double correlation_time_s = 0;  // of the coloured part; NaN without one
  double quantisation_std = 0;    // resolution / sqrt(12)
  double total_std = 0;           // sqrt(white^2 + coloured^2), not below quantisation_std
  double band_low_hz = 0;         // the band that was used
  double band_high_hz = 0;
};

// Fits the density 2 w^2 dt + c^2 * (AR(1) of correlation time tau) to Welch's spectrum (spectrum.h) between the motion
// and 0.95 of the Nyquist frequency by Whittle's likelihood: the sum over bands of nu (P / M + ln M), nu periodograms
// averaged to P in a band where the model gives M. The coloured part stays only when it raises twice the log-likelihood
// by more than 9.
//
// The motion's band is found by going down from the upper half of the spectrum for as long as the next band, a quarter
// octave lower, is no higher than the fit to those above it foretells (times 1.25 + 3 / sqrt(nu)). Given a residual
// without motion it reaches the lowest frequency. Motion that fills the band counts as noise: the floor is then an
// upper bound; coloured noise slower than 1 / (2 pi band_low_hz) cannot be told from motion and counts as that slow: a
// lower bound.
// A log that was filtered or upsampled before it was written (flexlink_2dsfl) has nothing left up there: only
// `resolution` then says what the sensor adds.
//
// `values`: measured signal or residual; rows that are not finite are bridged by a line. Rows are taken as the median
// step apart: jitter smears the motion a little, but not the noise, as interpolating would. Same size as `time_s`,
// which is strictly increasing.
NoiseFloor EstimateNoise(std::span<const double> time_s, std::span<const double> values,
                         const NoiseOptions& options = {});

// What one sample of a measured signal is known by, in its unit: the noise's total, or the resolution where the signal
// is too short to tell; not below a thousandth of its standard deviation.
double SensorNoise(std::span<const double> time_s, std::span<const double> values, double resolution);

// Integrated correlation time, s: dt (1 + 2 sum of the autocorrelations), the sum ended by Geyer's initial positive
// monotone sequence (Practical Markov chain Monte Carlo, Statistical Science 7, 1992). The mean of a residual of length
// T is known as well as from T / CorrelationTime independent samples; an AR(1) of coefficient rho has
// dt (1 + rho) / (1 - rho). Not below dt. The mean is removed; rows that are not finite are bridged. NaN below 4 finite
// rows or for a constant residual.
double CorrelationTime(std::span<const double> residual, double dt_s);

// n (1 - rho) / (1 + rho), between 1 and n: independent samples in n with lag-one correlation rho. NaN for |rho| > 1, a
// rho that is NaN or n = 0.
double EffectiveSamples(std::size_t n, double rho);

}  // namespace gapscope

#endif  // GAPSCOPE_COMPARE_NOISE_H_
