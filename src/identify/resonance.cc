// Resonance of a flexible joint: the peak of the deflection's spectrum, and the frequency with the base clamped from
// the balance of torques at the link.
//
//   a'' + th'' = -(K/J) a - (B/J) a'          (th base, a deflection)
//
// The peak gives K = J w_peak^2, as "Study and Control of the Mechanichal System: Rotary Flexible Joint", 2.2.1 does;
// it is the clamped frequency only where the base stands still. The regression needs no clamped base: what the base
// does is in it.
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "src/core/statistics.h"
#include "src/identify/filter.h"
#include "src/identify/regression.h"

namespace gapscope {
namespace {

struct Peak {
  double hz = 0, width_hz = 0;
};

// The peak of the Hann-windowed spectrum above `least_hz`, refined by evaluating the transform between the bins. It is
// sought in the spectrum of the speed, where a drift or the step that began the log do not count, and read off that of
// the angle.
Peak SpectrumPeak(const std::vector<double>& values, double dt, double least_hz, double most_hz, PointTable* spectrum) {
  const std::size_t n = values.size();
  double mean = 0;
  for (const double v : values) mean += v / static_cast<double>(n);
  const auto power = [&](double hz) {
    std::complex<double> sum = 0, turn = std::polar(1.0, -2 * std::numbers::pi * hz * dt), phase = 1;
    for (std::size_t k = 0; k < n; ++k) {
      sum += (values[k] - mean) *
             (0.5 - 0.5 * std::cos(2 * std::numbers::pi * (static_cast<double>(k) + 0.5) / static_cast<double>(n))) *
             phase;
      phase *= turn;
    }
    return std::norm(sum);
  };
  const double bin = 1 / (static_cast<double>(n) * dt);
  double best = 0, at = 0;
  for (double hz = least_hz; hz <= most_hz; hz += 0.25 * bin) {
    const double p = power(hz);
    if (spectrum) spectrum->rows.push_back({hz, std::sqrt(p) * 4 / static_cast<double>(n)});
    if (p * hz * hz > best) best = p * hz * hz, at = hz;
  }
  // The angle's own maximum next to it.
  double height = 0;
  for (double hz = std::max(least_hz, at - bin), end = at + bin; hz <= end; hz += 0.1 * bin) {
    if (const double p = power(hz); p > height) height = p, at = hz;
  }
  double low = at - 0.1 * bin, high = at + 0.1 * bin;
  for (int i = 0; i < 30; ++i) {
    const double a = low + 0.382 * (high - low), b = low + 0.618 * (high - low);
    (power(a) > power(b) ? high : low) = power(a) > power(b) ? b : a;
  }
  return {.hz = 0.5 * (low + high), .width_hz = bin};
}

// The joint asked for, or the one with a spring.
Result<int> FlexibleJointOf(const Model& model, const std::string& asked) {
  if (!asked.empty()) return DrivenJoint(model, asked);
  const mjModel& m = model.compiled();
  int joint = -1;
  for (int j = 0; j < m.njnt; ++j) {
    if (m.jnt_stiffness[j] > 0) joint = j;
  }
  if (joint < 0)
    return Error{.what = "the model has no joint with a spring",
                 .where = model.experiment().model_path,
                 .cure = "name the flexible joint by --joint"};
  return joint;
}

// What the logs show of a deflection and of the base under it.
struct Oscillation {
  Rows rows{{"deflection", "deflection's speed", "constant"}};
  std::vector<double> peaks_hz;  // one a log
  double width_hz = 0, dt_s = 0;
  PointTable spectrum{.name = "spectrum", .columns = {"frequency_hz", "amplitude_rad"}, .rows = {}};  // the first log's
};

Result<Oscillation> ReadOscillation(const IdentifyInput& input, int joint, int base, const IdentifyOptions& options) {
  Oscillation seen;
  for (std::size_t log = 0; log < input.recordings.size(); ++log) {
    const Recording& recording = input.recordings[log];
    const auto *deflection = FindSignal(input.model, recording, SignalKind::kPosition, joint),
               *carrier = FindSignal(input.model, recording, SignalKind::kPosition, base);
    if (!deflection || !carrier)
      return Error{.what = "a resonance needs the angles of the base and of the flexible joint",
                   .where = recording.log_path};
    const SmoothLog smooth(recording, options);
    const double dt = seen.dt_s = smooth.dt_s();
    const std::vector<double> grid = smooth.GridOf(deflection->values, false);
    if (grid.size() < 100)
      return Error{.what = "the log is too short for a spectrum",
                   .where = recording.log_path,
                   .actual = std::to_string(grid.size()) + " rows",
                   .allowed = "at least 100"};
    const double duration = static_cast<double>(grid.size()) * dt;
    // Below one and a half turns in the log a peak is a drift.
    const Peak peak =
        SpectrumPeak(grid, dt, 1.5 / duration, std::min(0.25 / dt, 15.0), log == 0 ? &seen.spectrum : nullptr);
    seen.peaks_hz.push_back(peak.hz);
    seen.width_hz = std::max(seen.width_hz, peak.width_hz);
    const std::vector<double> a = smooth.Sampled(deflection->values, 0), da = smooth.Sampled(deflection->values, 1),
                              dda = smooth.Sampled(deflection->values, 2), ddth = smooth.Sampled(carrier->values, 2);
    for (std::size_t i = 0; i < smooth.size(); ++i)
      seen.rows.Add(static_cast<int>(log), smooth.time_s(i), dda[i] + ddth[i], {-a[i], -da[i], 1});
  }
  return seen;
}

constexpr double kTwoPi = 2 * std::numbers::pi;

// Returns the mean of the logs' peaks.
double AddPeakValues(const Oscillation& seen, double inertia, Identification* result) {
  const auto [mean, deviation] = MomentsOf(seen.peaks_hz);
  const double n = static_cast<double>(seen.peaks_hz.size());
  // One log: a quarter of the spectrum's own resolution. Several: their scatter as well.
  const double half = std::max(n > 1 ? StudentQuantile(n - 1) * deviation / std::sqrt(n - 1) : 0, 0.25 * seen.width_hz);
  result->values.push_back(
      {.name = "peak_frequency", .unit = "Hz", .value = mean, .low = mean - half, .high = mean + half});
  const auto stiffness = [&](double hz) { return inertia * kTwoPi * kTwoPi * hz * hz; };
  result->values.push_back({.name = "stiffness_from_peak",
                            .unit = "N m/rad",
                            .value = stiffness(mean),
                            .low = stiffness(mean - half),
                            .high = stiffness(mean + half)});
  return mean;
}

void AddClampedValues(const Regression& fit, double inertia, double peak_hz, Identification* result) {
  if (!(fit.value[0] > 0)) {
    result->remarks.push_back("the deflection does not answer like a spring in these logs");
    return;
  }
  const double w2 = fit.value[0], hz = std::sqrt(w2) / kTwoPi;
  const auto to_hz = [](double x) { return x > 0 ? std::sqrt(x) / kTwoPi : 0; };
  result->values.push_back(
      {.name = "clamped_frequency", .unit = "Hz", .value = hz, .low = to_hz(fit.low[0]), .high = to_hz(fit.high[0])});
  result->values.push_back({.name = "stiffness",
                            .unit = "N m/rad",
                            .value = inertia * w2,
                            .low = inertia * fit.low[0],
                            .high = inertia * fit.high[0]});
  result->values.push_back(ToEstimate(fit, 1, "damping_rate", "1/s"));
  result->values.push_back({.name = "damping",
                            .unit = "N m s/rad",
                            .value = inertia * fit.value[1],
                            .low = inertia * fit.low[1],
                            .high = inertia * fit.high[1]});
  result->values.push_back({.name = "damping_ratio",
                            .unit = "1",
                            .value = 0.5 * fit.value[1] / std::sqrt(w2),
                            .low = 0.5 * fit.low[1] / std::sqrt(w2),
                            .high = 0.5 * fit.high[1] / std::sqrt(w2)});
  if (std::abs(hz - peak_hz) > 0.1 * hz) {
    result->remarks.push_back(
        "the peak is not the clamped frequency: the base moves with the link, or the input has its own peak; "
        "stiffness_from_peak is then wrong");
  }
}

}  // namespace

Result<Identification> IdentifyResonance(const IdentifyInput& input, const IdentifyOptions& options) {
  GS_ASSIGN(const int joint, FlexibleJointOf(input.model, options.joint));
  GS_ASSIGN(const int base, DrivenJoint(input.model, ""));
  IdentifyOptions quiet = options;
  quiet.cutoff_hz = QuietCutoff(input, joint, 1, 0.003, options);
  GS_ASSIGN(Oscillation seen, ReadOscillation(input, joint, base, quiet));
  GS_ASSIGN(const Regression fit, Regress(seen.rows, seen.dt_s));
  Identification result{
      .method = "resonance",
      .relation = "deflection'' + base'' = -(2 pi clamped_frequency)^2 deflection - damping_rate deflection'",
      .r2 = fit.r2,
      .rmse = fit.rmse,
      .unit = "rad/s^2",
      .rows = fit.rows};
  const double inertia = DrivenInertia(input.model.compiled(), joint);
  const double peak_hz = AddPeakValues(seen, inertia, &result);
  AddClampedValues(fit, inertia, peak_hz, &result);
  result.values.push_back({.name = "inertia_nominal", .unit = "kg m2", .value = inertia, .low = kNaN, .high = kNaN});
  if (fit.r2 < 0.8)
    result.remarks.push_back(
        "the spring's equation explains less than 80 % of the acceleration: noise of the second derivative (lower "
        "--cutoff), or higher modes");
  result.tables.push_back(std::move(seen.spectrum));
  return result;
}

}  // namespace gapscope
