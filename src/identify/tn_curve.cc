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
  double peak, power, no_load = kNaN;
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

// What the drive was asked for, by the nominal model's own law, linear in command, angle and speed.
std::vector<double> Demand(const mjModel& m, int joint, const Recording& recording, const SmoothLog& smooth,
                           const std::vector<double>& angle, const std::vector<double>& speed) {
  std::vector<double> demand(smooth.size(), 0.0);
  for (const auto& command : recording.commands) {
    const int actuator = mj_name2id(&m, mjOBJ_ACTUATOR, command.actuator.c_str());
    if (actuator < 0 || m.actuator_trntype[actuator] != mjTRN_JOINT || m.actuator_trnid[2 * actuator] != joint)
      continue;
    const std::vector<double> u = smooth.GridOf(command.values, true);
    const mjtNum *gain = m.actuator_gainprm + mjNGAIN * actuator, *bias = m.actuator_biasprm + mjNBIAS * actuator;
    for (std::size_t i = 0; i < smooth.size(); ++i)
      demand[i] += gain[0] * u[i] + bias[0] + bias[1] * angle[i] + bias[2] * speed[i];
  }
  return demand;
}

// The rows in which the drive pushes.
struct PushedRows {
  std::vector<Sample> samples;
  std::size_t limited = 0;
  double fastest = 0, strongest = 0, power = 0;  // the largest of each

  // Whether the drive was asked for more than it gave in enough rows to see what it can do.
  bool ReachesLimit() const { return limited > samples.size() / 100; }
};

Result<PushedRows> ReadPushedRows(const IdentifyInput& input, int joint, const IdentifyOptions& options) {
  PushedRows rows;
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
    const std::vector<double> demand = Demand(input.model.compiled(), joint, recording, smooth, q, w);
    for (std::size_t i = 0; i < smooth.size(); ++i) {
      if (!std::isfinite(t[i]) || !std::isfinite(w[i]) || t[i] * w[i] < 0) continue;
      const bool limited = std::abs(demand[i]) > 1.15 * std::abs(t[i]) && demand[i] * t[i] > 0;
      rows.samples.push_back({std::abs(w[i]), std::abs(t[i]), limited});
      rows.limited += limited ? 1 : 0;
    }
  }
  if (rows.samples.size() < 200)
    return Error{.what = "too few rows in which the drive pushes",
                 .where = input.recordings.front().log_path,
                 .actual = std::to_string(rows.samples.size()),
                 .allowed = "at least 200"};
  for (const auto& s : rows.samples) {
    rows.fastest = std::max(rows.fastest, s.speed);
    rows.strongest = std::max(rows.strongest, s.torque);
    rows.power = std::max(rows.power, s.speed * s.torque);
  }
  return rows;
}

// The middle, in each bin of speed, of the rows where the drive was asked for more; where there are too few of those,
// near the top of all rows. `table`: a row per bin.
Envelope EnvelopeOf(const PushedRows& rows, PointTable* table) {
  constexpr int kBins = 16;
  const bool reaches = rows.ReachesLimit();
  Envelope envelope;
  for (int b = 0; b < kBins; ++b) {
    std::vector<double> torques, all;
    double speed = 0;
    for (const auto& s : rows.samples) {
      if (s.speed < rows.fastest * b / kBins || s.speed >= rows.fastest * (b + 1) / kBins) continue;
      all.push_back(s.torque);
      if (s.limited || !reaches) torques.push_back(s.torque), speed += s.speed;
    }
    if (torques.size() < 10) continue;
    const double w = speed / static_cast<double>(torques.size()), top = Quantile(torques, reaches ? 0.5 : 0.99);
    envelope.emplace_back(w, top);
    table->rows.push_back(
        {w, top, w * top, static_cast<double>(all.size()), reaches ? static_cast<double>(torques.size()) : 0.0});
  }
  return envelope;
}

using Interval = std::pair<double, double>;  // NaN: none known

struct CurveFit {
  Curve curve;
  Interval peak{kNaN, kNaN}, power{kNaN, kNaN}, no_load{kNaN, kNaN};  // 95 %
};

// Intervals: the same fit over bins drawn again (bootstrap percentiles; Efron and Tibshirani, "An Introduction to the
// Bootstrap", 1993), and a step of the grid. A side of the corner without bins has none.
CurveFit FitWithIntervals(const Envelope& envelope, double strongest, double power) {
  CurveFit fit{.curve = {.peak = strongest, .power = power}};
  if (envelope.size() < 3) return fit;
  fit.curve = FitWithNoLoad(envelope, strongest, power);
  std::vector<double> peaks, powers, no_loads;
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
  const auto interval = [](const std::vector<double>& values, double step) {
    return Interval{Quantile(values, 0.025) - step, Quantile(values, 0.975) + step};
  };
  const double peak = fit.curve.peak, bound = fit.curve.power;
  const auto some = [&](auto condition) { return std::any_of(envelope.begin(), envelope.end(), condition); };
  if (some([&](const auto& bin) { return bin.first * peak < 0.8 * bound; }))
    fit.peak = interval(peaks, kGridStep * strongest);
  if (some([&](const auto& bin) { return bin.first * peak > 1.2 * bound; }))
    fit.power = interval(powers, kGridStep * power);
  if (std::isfinite(fit.curve.no_load) && no_loads.size() > kDraws / 2) fit.no_load = interval(no_loads, 0);
  return fit;
}

}  // namespace

Result<Identification> IdentifyTnCurve(const IdentifyInput& input, const IdentifyOptions& options) {
  GS_ASSIGN(const int joint, DrivenJoint(input.model, options.joint));
  GS_ASSIGN(const PushedRows rows, ReadPushedRows(input, joint, options));
  PointTable table{
      .name = "envelope", .columns = {"speed_rad_per_s", "torque_n_m", "power_w", "rows", "limited_rows"}, .rows = {}};
  const Envelope envelope = EnvelopeOf(rows, &table);
  const CurveFit fit = FitWithIntervals(envelope, rows.strongest, rows.power);
  Identification result{
      .method = "tn-curve",
      .relation = "|torque| <= min(peak, power / speed), envelope of the rows in which the drive pushes",
      .r2 = kNaN,
      .rmse = kNaN,
      .unit = "N m",
      .rows = rows.samples.size()};
  const auto add = [&](const char* name, const char* unit, double value, Interval bounds = {kNaN, kNaN}) {
    result.values.push_back({.name = name, .unit = unit, .value = value, .low = bounds.first, .high = bounds.second});
  };
  const Curve& curve = fit.curve;
  add("peak_torque", "N m", curve.peak, fit.peak);
  add("power", "W", curve.power, fit.power);
  add("corner_speed", "rad/s", curve.power / curve.peak);
  if (std::isfinite(curve.no_load)) add("no_load_speed", "rad/s", curve.no_load, fit.no_load);
  add("fastest", "rad/s", rows.fastest);
  if (options.rated_torque_n_m > 0 && options.rated_speed_rad_per_s > 0) {
    const double rated = options.rated_torque_n_m * options.rated_speed_rad_per_s;
    add("rated_power", "W", rated);
    if (curve.power < rated) result.remarks.push_back("these logs never reach the rated power");
  }
  if (!rows.ReachesLimit())
    result.remarks.push_back(
        "the drive was hardly ever asked for more than it gave: the envelope is how far the log went, not what the "
        "motor can do");
  if (std::isnan(curve.no_load))
    result.remarks.push_back(
        "the torque never falls short of the constant power at high speed: the no-load speed lies beyond the fastest "
        "row");
  if (std::isnan(fit.power.first)) result.remarks.push_back("no rows beyond the corner: the power is a lower bound");
  result.tables.push_back(std::move(table));
  return result;
}

}  // namespace gapscope
