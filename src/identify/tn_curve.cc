// The envelope of torque against speed: peak torque, the power that bounds it at speed, the speed without load. Source:
// "Motor System Identification", "TN curve".
#include <algorithm>
#include <cmath>
#include <random>

#include "src/core/statistics.h"
#include "src/identify/filter.h"
#include "src/identify/regression.h"

namespace gapscope {
namespace {

struct Sample {
  double speed, torque;  // magnitudes; motoring only
  bool limited;          // the servo asked for more
};

using Envelope = std::vector<std::pair<double, double>>;  // speed, torque

struct Curve {
  double peak, power, no_load = NAN;
};
constexpr int kGrid = 60, kDraws = 200;
constexpr double kGridStep = 0.6 / kGrid;

// Peak and constant power by least absolute deviation of the envelope's logarithm over a grid from 0.4 of the largest
// torque and power to those: the corner is where they meet.
Curve FitCurve(const Envelope& envelope, double strongest, double power) {
  double best = INFINITY;
  Curve curve{.peak = strongest, .power = power};
  std::vector<double> logs, speeds;
  for (const auto& [speed, torque] : envelope) {
    logs.push_back(std::log(torque));
    speeds.push_back(std::log(std::max(speed, 1e-9)));
  }
  for (int i = 0; i <= kGrid; ++i) {
    const double peak = std::log(strongest * (0.4 + kGridStep * i));
    for (int j = 0; j <= kGrid; ++j) {
      const double watts = std::log(power * (0.4 + kGridStep * j));
      double misfit = 0;
      for (std::size_t k = 0; k < logs.size() && misfit < best; ++k)
        misfit += std::abs(std::min(peak, watts - speeds[k]) - logs[k]);
      if (misfit < best) best = misfit, curve = {.peak = std::exp(peak), .power = std::exp(watts)};
    }
  }
  return curve;
}

// The same, and the speed at which the torque is gone: where the fastest bins fall short of the constant power they are
// the drive running out of voltage, a line to zero, and no part of the power.
Curve FitWithNoLoad(Envelope envelope, double strongest, double power) {
  constexpr double kShort = 0.88;
  constexpr std::size_t kLeast = 2;
  std::sort(envelope.begin(), envelope.end());
  Curve curve = FitCurve(envelope, strongest, power);
  std::size_t kept = envelope.size();
  for (int round = 0; round < 4; ++round) {
    std::size_t first = envelope.size();
    while (first > 0 &&
           envelope[first - 1].second < kShort * std::min(curve.peak, curve.power / envelope[first - 1].first))
      --first;
    if (first == kept || envelope.size() - first < kLeast || first < kLeast) break;
    kept = first;
    curve = FitCurve({envelope.begin(), envelope.begin() + static_cast<std::ptrdiff_t>(kept)}, strongest, power);
  }
  if (envelope.size() - kept < kLeast) return curve;
  double w = 0, t = 0, ww = 0, wt = 0;
  const double n = static_cast<double>(envelope.size() - kept);
  for (std::size_t k = kept; k < envelope.size(); ++k) w += envelope[k].first / n, t += envelope[k].second / n;
  for (std::size_t k = kept; k < envelope.size(); ++k)
    ww += std::pow(envelope[k].first - w, 2), wt += (envelope[k].first - w) * (envelope[k].second - t);
  if (ww > 0 && wt < 0) curve.no_load = w - t * ww / wt;
  return curve;
}

}  // namespace

Result<Identification> IdentifyTnCurve(const IdentifyInput& input, const IdentifyOptions& options) {
  GS_ASSIGN(const int joint, DrivenJoint(input.model, options.joint));
  const mjModel& m = input.model.compiled();
  std::vector<Sample> samples;
  std::size_t limited = 0;
  for (const Recording& recording : input.recordings) {
    const auto* torque = FindSignal(input.model, recording, SignalKind::kTorque, joint);
    const auto* angle = FindSignal(input.model, recording, SignalKind::kPosition, joint);
    if (!torque || !angle)
      return Error{.what = "a torque-speed curve needs torque and angle",
                   .where = recording.log_path,
                   .cure = "a measured signal of 'kind: torque' in " + input.model.experiment().path};
    const SmoothLog smooth(recording, options);
    // Only the speed needs the low pass: it would round off the corners of what is to be seen.
    const std::vector<double> t = smooth.GridOf(torque->values, false), q = smooth.GridOf(angle->values, false),
                              w = smooth.Sampled(angle->values, 1);
    // What the drive was asked for, by the nominal model's own law, linear in command, angle and speed.
    std::vector<double> demand(smooth.size(), 0.0);
    for (std::size_t c = 0; c < recording.commands.size(); ++c) {
      const int actuator = mj_name2id(&m, mjOBJ_ACTUATOR, recording.commands[c].actuator.c_str());
      if (actuator < 0 || m.actuator_trntype[actuator] != mjTRN_JOINT || m.actuator_trnid[2 * actuator] != joint)
        continue;
      const std::vector<double> u = smooth.GridOf(recording.commands[c].values, true);
      const mjtNum *gain = m.actuator_gainprm + mjNGAIN * actuator, *bias = m.actuator_biasprm + mjNBIAS * actuator;
      for (std::size_t i = 0; i < smooth.size(); ++i)
        demand[i] += gain[0] * u[i] + bias[0] + bias[1] * q[i] + bias[2] * w[i];
    }
    for (std::size_t i = 0; i < smooth.size(); ++i) {
      if (!std::isfinite(t[i]) || !std::isfinite(w[i]) || t[i] * w[i] < 0) continue;
      samples.push_back(
          {std::abs(w[i]), std::abs(t[i]), std::abs(demand[i]) > 1.15 * std::abs(t[i]) && demand[i] * t[i] > 0});
      limited += samples.back().limited ? 1 : 0;
    }
  }
  if (samples.size() < 200)
    return Error{.what = "too few rows in which the drive pushes",
                 .where = input.recordings.front().log_path,
                 .actual = std::to_string(samples.size()),
                 .allowed = "at least 200"};
  double fastest = 0, strongest = 0, power = 0;
  for (const auto& s : samples) {
    fastest = std::max(fastest, s.speed);
    strongest = std::max(strongest, s.torque);
    power = std::max(power, s.speed * s.torque);
  }
  const bool reaches = limited > samples.size() / 100;
  // The envelope: the middle, in each bin of speed, of the rows where the drive was asked for more; where there are too
  // few of those, near the top of all rows.
  constexpr int kBins = 16;
  PointTable table{
      .name = "envelope", .columns = {"speed_rad_per_s", "torque_n_m", "power_w", "rows", "limited_rows"}, .rows = {}};
  Envelope envelope;
  for (int b = 0; b < kBins; ++b) {
    std::vector<double> torques, all;
    double speed = 0;
    for (const auto& s : samples) {
      if (s.speed < fastest * b / kBins || s.speed >= fastest * (b + 1) / kBins) continue;
      all.push_back(s.torque);
      if (s.limited || !reaches) torques.push_back(s.torque), speed += s.speed;
    }
    if (torques.size() < 10) continue;
    const double w = speed / static_cast<double>(torques.size()), top = Quantile(torques, reaches ? 0.5 : 0.99);
    envelope.emplace_back(w, top);
    table.rows.push_back(
        {w, top, w * top, static_cast<double>(all.size()), reaches ? static_cast<double>(torques.size()) : 0.0});
  }
  Identification result{
      .method = "tn-curve",
      .relation = "|torque| <= min(peak, power / speed), envelope of the rows in which the drive pushes",
      .r2 = NAN,
      .rmse = NAN,
      .unit = "N m",
      .rows = samples.size()};
  Curve curve{.peak = strongest, .power = power};
  std::vector<double> peaks, powers, no_loads;
  if (envelope.size() >= 3) {
    curve = FitWithNoLoad(envelope, strongest, power);
    // Intervals: the same over bins drawn again (bootstrap percentiles; Efron and Tibshirani, "An Introduction to the
    // Bootstrap", 1993), and a step of the grid.
    std::mt19937 random(1);
    std::uniform_int_distribution<std::size_t> pick(0, envelope.size() - 1);
    for (int draw = 0; draw < kDraws; ++draw) {
      Envelope again;
      for (std::size_t k = 0; k < envelope.size(); ++k) again.push_back(envelope[pick(random)]);
      const Curve other = FitWithNoLoad(again, strongest, power);
      peaks.push_back(other.peak);
      powers.push_back(other.power);
      if (std::isfinite(other.no_load)) no_loads.push_back(other.no_load);
    }
  }
  const double peak = curve.peak, bound = curve.power;
  const bool before =
      std::any_of(envelope.begin(), envelope.end(), [&](const auto& bin) { return bin.first * peak < 0.8 * bound; });
  const bool beyond =
      std::any_of(envelope.begin(), envelope.end(), [&](const auto& bin) { return bin.first * peak > 1.2 * bound; });
  const auto interval = [](const std::vector<double>& values, double step) {
    return std::pair{Quantile(values, 0.025) - step, Quantile(values, 0.975) + step};
  };
  const auto nothing = std::pair<double, double>{NAN, NAN};
  const auto [pl, ph] = before && !peaks.empty() ? interval(peaks, kGridStep * strongest) : nothing;
  const auto [wl, wh] = beyond && !powers.empty() ? interval(powers, kGridStep * power) : nothing;
  result.values.push_back({.name = "peak_torque", .unit = "N m", .value = peak, .low = pl, .high = ph});
  result.values.push_back({.name = "power", .unit = "W", .value = bound, .low = wl, .high = wh});
  result.values.push_back({.name = "corner_speed", .unit = "rad/s", .value = bound / peak, .low = NAN, .high = NAN});
  const auto [nl, nh] = std::isfinite(curve.no_load) && no_loads.size() > kDraws / 2 ? interval(no_loads, 0) : nothing;
  if (std::isfinite(curve.no_load))
    result.values.push_back({.name = "no_load_speed", .unit = "rad/s", .value = curve.no_load, .low = nl, .high = nh});
  result.values.push_back({.name = "fastest", .unit = "rad/s", .value = fastest, .low = NAN, .high = NAN});
  if (options.rated_torque_n_m > 0 && options.rated_speed_rad_per_s > 0) {
    const double rated = options.rated_torque_n_m * options.rated_speed_rad_per_s;
    result.values.push_back({.name = "rated_power", .unit = "W", .value = rated, .low = NAN, .high = NAN});
    if (bound < rated) result.remarks.push_back("these logs never reach the rated power");
  }
  if (!reaches)
    result.remarks.push_back(
        "the drive was hardly ever asked for more than it gave: the envelope is how far the log went, not what the "
        "motor can do");
  if (std::isnan(curve.no_load))
    result.remarks.push_back(
        "the torque never falls short of the constant power at high speed: the no-load speed lies beyond the fastest "
        "row");
  if (std::isnan(wl)) result.remarks.push_back("no rows beyond the corner: the power is a lower bound");
  result.tables.push_back(std::move(table));
  return result;
}

}  // namespace gapscope
