// The chirp test of a position servo: gains from a wanted natural frequency and damping ratio, and the largest chirp
// that a speed limit allows.
//
//   w = 2 pi f,  kp = J w^2,  kd = 2 z J w,  settling time 4 / (z w)
//   bandwidth f sqrt(1 - 2 z^2 + sqrt(4 z^4 - 4 z^2 + 2))        (-3 dB of w^2 / (s^2 + 2 z w s + w^2))
//   amplitude k v / (2 pi f_end): the speed of a sine of frequency f_end reaches k times the limit v
//
// Source: "Motor System Identification", sections 2 to 6.
#ifndef GAPSCOPE_DESIGN_CHIRP_H_
#define GAPSCOPE_DESIGN_CHIRP_H_

#include <vector>

#include "src/core/result.h"

namespace gapscope {

struct ChirpRequest {
  double inertia_kg_m2 = 0;                // at the joint, > 0
  double natural_frequency_hz = 0;         // > 0
  std::vector<double> damping_ratios;      // > 0
  double speed_limit_rad_per_s = 0;        // > 0
  double amplitude_factor = 0.8;           // k, in (0, 1]
  std::vector<double> end_over_bandwidth;  // > 0
};

struct Chirp {
  double end_over_bandwidth = 0, end_frequency_hz = 0, amplitude_rad = 0;
};

struct ChirpRow {
  double damping_ratio = 0, kp_n_m_per_rad = 0, kd_n_m_s_per_rad = 0, settling_time_s = 0, bandwidth_hz = 0;
  std::vector<Chirp> chirps;  // in the order of end_over_bandwidth
};

// One row per damping ratio. Errors: a number that is not finite or outside its range.
Result<std::vector<ChirpRow>> DesignChirps(const ChirpRequest& request);

// The bandwidth of a second-order system over its natural frequency.
double BandwidthRatio(double damping_ratio);

}  // namespace gapscope

#endif  // GAPSCOPE_DESIGN_CHIRP_H_
