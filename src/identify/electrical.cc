// Resistance and sensor offset from voltages and currents at standstill: current = voltage / R + offset. The current is
// regressed on the voltage, since it is the current that is noisy. Source: "Quanser Qube 2 - Report", 2.2, which fits
// all points, those of positive and those of negative voltage (8.8, 8.3, 8.1 ohm): a current offset alone makes the
// three differ where the line is forced through the origin; it is a value here. And the torque constant from torque
// against current.
#include <algorithm>
#include <cmath>

#include "src/core/statistics.h"
#include "src/identify/plateaus.h"
#include "src/identify/regression.h"

namespace gapscope {
namespace {

Result<std::vector<std::vector<double>>> Currents(const IdentifyInput& input, const IdentifyOptions& options) {
  std::vector<std::vector<double>> currents;
  for (const auto& recording : input.recordings) {
    GS_ASSIGN(auto current, ExtraColumn(input.model, recording, options.current_column, options.current_unit));
    currents.push_back(std::move(current));
  }
  return currents;
}

Status NeedsUnit(const IdentifyInput& input, const char* unit, const char* what) {
  const auto& commands = input.model.experiment().commands;
  if (!commands.empty() && commands.front().unit == unit) return Ok();
  return Error{.what = what,
               .where = input.model.experiment().path,
               .actual = commands.empty() ? "no command" : "a command in " + commands.front().unit};
}

// A line through the points, its slope and offset with half their intervals. Each plateau is one reading: its rows
// share the drive's errors. So its own classical interval, and no blocks.
struct FittedLine {
  double slope = 0, slope_error = 0, offset = 0, offset_error = 0;
  double points = 0, rest = 0, spread = 0;  // sums of squares: left by the line; about the mean

  Estimate Resistance(const char* name) const {
    return {.name = name,
            .unit = "ohm",
            .value = 1 / slope,
            .low = 1 / (slope + slope_error),
            .high = slope > slope_error ? 1 / (slope - slope_error) : INFINITY};
  }
};

// Through the points with voltages of `sign`, 0: through all. None where they are fewer than four: `points` says so.
FittedLine LineThrough(const std::vector<Plateau>& plateaus, int sign) {
  double n = 0, sv = 0, si = 0, vv = 0, vi = 0, ii = 0;
  for (const auto& p : plateaus) {
    if (sign != 0 && p.command * sign <= 0) continue;
    n += 1, sv += p.command, si += p.current;
  }
  if (n < 4) return {.points = n};
  for (const auto& p : plateaus) {
    if (sign != 0 && p.command * sign <= 0) continue;
    const double dv = p.command - sv / n, di = p.current - si / n;
    vv += dv * dv, vi += dv * di, ii += di * di;
  }
  const double slope = vi / vv, offset = (si - slope * sv) / n, rest = std::max(0.0, ii - slope * vi),
               scatter = rest / (n - 2), t = StudentQuantile(n - 2);
  return {.slope = slope,
          .slope_error = t * std::sqrt(scatter / vv),
          .offset = offset,
          .offset_error = t * std::sqrt(scatter * (1 / n + sv * sv / (n * n) / vv)),
          .points = n,
          .rest = rest,
          .spread = ii};
}

}  // namespace

Result<Identification> IdentifyResistance(const IdentifyInput& input, const IdentifyOptions& options) {
  GS_RETURN_IF_ERROR(NeedsUnit(input, "V", "a resistance needs a drive that is commanded by voltage"));
  GS_ASSIGN(const int joint, DrivenJoint(input.model, options.joint));
  GS_ASSIGN(const auto currents, Currents(input, options));
  constexpr double kStandstill_rad_per_s = 0.05;
  std::vector<Plateau> points = FindPlateaus(input, joint, currents, options, 0.2);
  std::size_t moving = 0;
  std::erase_if(points, [&](const Plateau& p) {
    const bool moves = std::isfinite(p.speed) && std::abs(p.speed) > kStandstill_rad_per_s;
    moving += moves ? 1 : 0;
    return moves || !std::isfinite(p.current);
  });
  const FittedLine all = LineThrough(points, 0), positive = LineThrough(points, 1), negative = LineThrough(points, -1);
  if (all.points < 4)
    return Error{.what = "fewer than four standing voltages to put a line through",
                 .where = input.recordings.front().log_path,
                 .actual = std::to_string(static_cast<int>(all.points)) +
                           (moving > 0 ? ", and " + std::to_string(moving) + " at which the rotor turns" : ""),
                 .cure = "hold the rotor and step the voltage, 0.2 s or more a step"};
  Identification result{.method = "resistance",
                        .relation = "current = voltage / resistance + offset, rotor held",
                        .r2 = all.spread > 0 ? 1 - all.rest / all.spread : 0,
                        .rmse = std::sqrt(all.rest / all.points),
                        .unit = "A",
                        .rows = static_cast<std::size_t>(all.points)};
  result.values = {all.Resistance("resistance"),
                   {.name = "current_offset",
                    .unit = "A",
                    .value = all.offset,
                    .low = all.offset - all.offset_error,
                    .high = all.offset + all.offset_error}};
  if (positive.points >= 4) {
    result.values.push_back(positive.Resistance("resistance_positive"));
  } else {
    result.remarks.push_back("too few positive voltages for a line of their own");
  }
  if (negative.points >= 4) {
    result.values.push_back(negative.Resistance("resistance_negative"));
  } else {
    result.remarks.push_back("too few negative voltages for a line of their own");
  }
  if (moving > 0)
    result.remarks.push_back(std::to_string(moving) +
                             " steps at which the rotor turns are left out: back-EMF would count as resistance");
  PointTable table{.name = "points", .columns = {"voltage_v", "current_a", "speed_rad_per_s"}, .rows = {}};
  for (const auto& p : points) table.rows.push_back({p.command, p.current, p.speed});
  result.tables.push_back(std::move(table));
  return result;
}

Result<Identification> IdentifyCurrentOffset(const IdentifyInput& input, const IdentifyOptions& options) {
  GS_ASSIGN(const int joint, DrivenJoint(input.model, options.joint));
  GS_ASSIGN(const auto currents, Currents(input, options));
  constexpr double kStill_rad = 0.005;
  Rows rows({"constant"});
  for (std::size_t log = 0; log < input.recordings.size(); ++log) {
    const Recording& recording = input.recordings[log];
    const auto* angle = FindSignal(input.model, recording, SignalKind::kPosition, joint);
    const auto& t = recording.time_s;
    for (std::size_t k = 0; k < t.size(); ++k) {
      if (recording.commands.front().values[k] != 0 || t[k] < options.from_s ||
          (options.to_s > 0 && t[k] > options.to_s))
        continue;
      // Still over a tenth of a second, so that no back-EMF drives a current.
      bool still = true;
      for (std::size_t r = k; angle && still && r > 0 && t[k] - t[r - 1] <= 0.1; --r)
        still = std::abs(angle->values[r - 1] - angle->values[k]) <= kStill_rad &&
                recording.commands.front().values[r - 1] == 0;
      if (still) rows.Add(static_cast<int>(log), t[k], currents[log][k], {1});
    }
  }
  auto fit = Regress(rows, input.recordings.front().timeline.median_step_s);
  if (!fit.ok()) {
    return Error{.what = "the log does not stand still without a command",
                 .where = input.recordings.front().log_path,
                 .actual = std::to_string(rows.size()) + " such rows",
                 .allowed = "at least 20",
                 .cure = "log a second of zero command at rest"};
  }
  Identification result{.method = "current-offset",
                        .relation = "current = offset at zero command and rest",
                        .values = {ToEstimate(fit.value(), 0, "current_offset", "A")},
                        .r2 = kNaN,
                        .rmse = fit.value().rmse,
                        .unit = "A",
                        .rows = rows.size()};
  return result;
}

Result<Identification> IdentifyTorqueConstant(const IdentifyInput& input, const IdentifyOptions& options) {
  GS_ASSIGN(const int joint, DrivenJoint(input.model, options.joint));
  GS_ASSIGN(const auto currents, Currents(input, options));
  double peak = 0;
  struct Sample {
    int log;
    double time_s, current, square, torque;  // square: current |current|, formed before the low pass
  };
  std::vector<Sample> samples;
  double dt = 0;
  for (std::size_t log = 0; log < input.recordings.size(); ++log) {
    const Recording& recording = input.recordings[log];
    const auto* torque = FindSignal(input.model, recording, SignalKind::kTorque, joint);
    if (!torque)
      return Error{.what = "a torque constant needs a measured torque",
                   .where = recording.log_path,
                   .cure = "a measured signal of 'kind: torque' in " + input.model.experiment().path};
    const SmoothLog smooth(recording, options);
    dt = smooth.dt_s();
    std::vector<double> squares;
    for (const double c : currents[log]) squares.push_back(c * std::abs(c));
    const std::vector<double> i = smooth.Sampled(currents[log], 0), square = smooth.Sampled(squares, 0),
                              y = smooth.Sampled(torque->values, 0);
    for (std::size_t k = 0; k < smooth.size(); ++k) {
      if (!std::isfinite(i[k]) || !std::isfinite(y[k])) continue;
      samples.push_back({static_cast<int>(log), smooth.time_s(k), i[k], square[k], y[k]});
      peak = std::max(peak, std::abs(i[k]));
    }
  }
  Rows straight({"current", "constant"}), bent({"current", "current |current|", "constant"});
  for (const auto& s : samples) {
    straight.Add(s.log, s.time_s, s.torque, {s.current, 1});
    bent.Add(s.log, s.time_s, s.torque, {s.current, s.square, 1});
  }
  GS_ASSIGN(const Regression line, Regress(straight, dt));
  GS_ASSIGN(const Regression curve, Regress(bent, dt));
  Identification result{.method = "torque-constant",
                        .relation = "torque = kt current (1 - loss_at_peak |current| / peak) + offset",
                        .r2 = curve.r2,
                        .rmse = curve.rmse,
                        .unit = "N m",
                        .rows = curve.rows};
  result.values.push_back(ToEstimate(curve, 0, "kt", "N m/A"));
  // loss = -b2 peak / b1, by the delta method.
  const double loss = -curve.value[1] * peak / curve.value[0];
  const Eigen::Vector2d gradient(curve.value[1] * peak / (curve.value[0] * curve.value[0]), -peak / curve.value[0]);
  const double error =
      curve.quantile * std::sqrt(std::max(0.0, gradient.dot(curve.covariance.topLeftCorner(2, 2) * gradient)));
  result.values.push_back(
      {.name = "loss_at_peak", .unit = "1", .value = loss, .low = loss - error, .high = loss + error});
  result.values.push_back({.name = "peak_current", .unit = "A", .value = peak, .low = kNaN, .high = kNaN});
  result.values.push_back(ToEstimate(curve, 2, "offset", "N m"));
  result.values.push_back(ToEstimate(line, 0, "kt_straight", "N m/A"));
  result.values.push_back({.name = "r2_straight", .unit = "1", .value = line.r2, .low = kNaN, .high = kNaN});
  if (loss - error <= 0) result.remarks.push_back("no bend is seen up to the peak current of this log");
  PointTable table{.name = "points", .columns = {"current_a", "torque_n_m"}, .rows = {}};
  for (std::size_t k = 0; k < samples.size(); k += std::max<std::size_t>(1, samples.size() / 500))
    table.rows.push_back({samples[k].current, samples[k].torque});
  result.tables.push_back(std::move(table));
  return result;
}

}  // namespace gapscope
