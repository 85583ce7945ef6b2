// What a sensor does to a signal between the mechanism and the log.
#ifndef GAPSCOPE_REPLAY_SENSORS_H_
#define GAPSCOPE_REPLAY_SENSORS_H_

#include <span>

namespace gapscope {

// A late sensor: out[k] is `in` at time[k] - delay_s, on the cubic through the neighbouring stamps (Catmull-Rom
// slopes); before the first stamp on the line through the first two. All of one size, at least 2; `time` grows.
void Delay(std::span<const double> time, std::span<const double> in, double delay_s, std::span<double> out);

struct LowPassFilter {
  double cutoff_rad_per_s = 1, damping_ratio = 1;
};

// y'' = w^2 (x - y) - 2 z w y', solved exactly for an input that is linear between stamps, from y = `value`, y' =
// `slope`. All of one size.
void LowPass(std::span<const double> time, std::span<const double> in, const LowPassFilter& filter, double value,
             double slope, std::span<double> out);

}  // namespace gapscope

#endif  // GAPSCOPE_REPLAY_SENSORS_H_
