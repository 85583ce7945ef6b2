// Test signals of unit amplitude, sampled on a regular grid. All begin at zero (a square wave at its first level).
#ifndef GAPSCOPE_DESIGN_WAVEFORM_H_
#define GAPSCOPE_DESIGN_WAVEFORM_H_

#include <cstdint>
#include <string>
#include <vector>

#include "src/core/enum_names.h"
#include "src/core/result.h"

namespace gapscope {

enum class WaveShape { kChirp, kSteps, kTriangle, kMultisine, kSquare };
template <>
std::span<const EnumName<WaveShape>> EnumNames<WaveShape>();  // "chirp", "steps", ...

struct Waveform {
  WaveShape shape = WaveShape::kChirp;
  double duration_s = 10;
  double low_hz = 0.1;  // chirp: start; multisine: lowest line; steps: a level is held for half to one and a half times
                        // 1 / (2 low_hz); triangle, square: 1 / period
  double high_hz = 5;   // chirp: end; multisine: highest line; else unused
  std::uint64_t seed = 0;  // steps: levels
  bool mirrored = false;   // the second half is the first one with its sign changed: what integrates its command goes
                           // to both sides
};

// Chirp: sin(2 pi (f0 t + (f1 - f0) t^2 / (2 T))), linear. Triangle: up first. Multisine: up to 24 lines, evenly spaced
// in the logarithm and moved to multiples of 1 / duration, Schroeder's phases (Schroeder, "Synthesis of low-peak-factor
// signals and binary sequences with low autocorrelation", IEEE Trans. Inf. Theory 16, 1970), scaled to a peak of one,
// faded in over a tenth of the duration. Steps: levels of either sign in turn, 0.3 to 1 in size, the first and the last
// tenth of the time at zero. Square: +1 first. `rate_hz` samples per second, floor(duration * rate) + 1 rows. Errors: a
// number out of range; frequencies above a quarter of the rate; more than 10^7 rows.
Result<std::vector<double>> SampleWaveform(const Waveform& wave, double rate_hz);

}  // namespace gapscope

#endif  // GAPSCOPE_DESIGN_WAVEFORM_H_
