// The memoryless stages of a drive, each a pure function; equations and sources in README.md.
#ifndef GAPSCOPE_PLUGINS_MOTOR_STAGES_H_
#define GAPSCOPE_PLUGINS_MOTOR_STAGES_H_

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace gapscope::plugins {

// Input less the half width, zero inside: continuous.
inline double DeadZone(double x, double half_width) {
  return x > half_width ? x - half_width : x < -half_width ? x + half_width : 0;
}

// A non-negative function of speed given at points, held at its ends.
class SpeedTable {
 public:
  enum class Interpolation { kLinear, kMonotoneCubic };

  // `speed` strictly ascending from >= 0, `torque` >= 0, as many points (at least 2).
  // Monotone cubic: Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980): no overshoot between the points.
  void Set(std::vector<double> speed, std::vector<double> torque, Interpolation interpolation) {
    speed_ = std::move(speed);
    torque_ = std::move(torque);
    slope_.clear();
    if (interpolation == Interpolation::kLinear) return;
    const std::size_t n = speed_.size();
    std::vector<double> chord(n - 1);
    for (std::size_t i = 0; i + 1 < n; ++i) chord[i] = (torque_[i + 1] - torque_[i]) / (speed_[i + 1] - speed_[i]);
    slope_.assign(n, 0.0);
    slope_[0] = chord[0];
    slope_[n - 1] = chord[n - 2];
    for (std::size_t i = 1; i + 1 < n; ++i) {
      // Weighted harmonic mean; zero at an extremum.
      if (chord[i - 1] * chord[i] <= 0) continue;
      const double left = speed_[i] - speed_[i - 1], right = speed_[i + 1] - speed_[i];
      const double w1 = 2 * right + left, w2 = right + 2 * left;
      slope_[i] = (w1 + w2) / (w1 / chord[i - 1] + w2 / chord[i]);
    }
  }

  bool empty() const { return speed_.empty(); }
  double peak() const { return torque_.front(); }

  double operator()(double speed) const {
    if (speed <= speed_.front()) return torque_.front();
    if (speed >= speed_.back()) return torque_.back();
    const std::size_t i = std::upper_bound(speed_.begin(), speed_.end(), speed) - speed_.begin() - 1;
    const double dx = speed_[i + 1] - speed_[i], s = (speed - speed_[i]) / dx, r = 1 - s;
    if (slope_.empty()) return r * torque_[i] + s * torque_[i + 1];
    return r * r * (1 + 2 * s) * torque_[i] + s * s * (1 + 2 * r) * torque_[i + 1] +
           s * r * dx * (r * slope_[i] - s * slope_[i + 1]);
  }

 private:
  std::vector<double> speed_, torque_, slope_;
};

// Peak torque up to the rated speed, then a line to zero at no-load speed; without a no-load speed it stays at the
// peak.
inline double TrapezeLimit(double speed, double peak, double rated, double no_load) {
  if (!(no_load > 0) || speed <= rated) return peak;
  return speed >= no_load ? 0 : peak * (no_load - speed) / (no_load - rated);
}

// |torque * speed| <= power.
inline double PowerLimit(double speed, double power) {
  return speed > 0 ? power / speed : std::numeric_limits<double>::infinity();
}

// `torque` held within +-limit; the corner is a parabola from limit (1 - softness) to limit (1 + softness), of slope 1
// and 0 at its ends.
inline double SoftLimit(double torque, double limit, double softness) {
  const double size = std::abs(torque), half = softness * limit, into = size - (limit - half);
  if (!(into > 0)) return torque;
  return std::copysign(into >= 2 * half ? limit : size - into * into / (4 * half), torque);
}

// The torque constant falls with a power of the torque's size, 1 for a straight line; at `reference` the loss is
// `droop`.
inline double Droop(double torque, double droop, double reference, double exponent) {
  const double size = std::abs(torque) / reference;
  return torque * std::max(0.0, 1 - droop * (exponent == 1 ? size : std::pow(size, exponent)));
}

// One lag that is exact for a held request and well behaved for any time constant: at least one step h is given to the
// state x, and below that the output is blended, w x + (1 - w) request with w = tc/h, which is the request at tc = 0.
struct Lag {
  double weight, rate;  // of the state in the output; of the state's change, 1/s

  // `staged`: an integrator that evaluates act_dot within the step (RK4); else act' h must be the whole exact change.
  Lag(double time_constant, double step, bool staged)
      : weight(std::clamp(time_constant / step, 0.0, 1.0)),
        rate(staged ? 1 / std::max(time_constant, step) : -std::expm1(-step / std::max(time_constant, step)) / step) {}
  double Output(double state, double request) const { return request + weight * (state - request); }
  double Derivative(double state, double request) const { return (request - state) * rate; }
};

}  // namespace gapscope::plugins

#endif  // GAPSCOPE_PLUGINS_MOTOR_STAGES_H_
