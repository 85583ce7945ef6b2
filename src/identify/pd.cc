// Gains of a position servo: torque(t) = kp e(t - d) - kd w(t - d) + c, e = target - angle, by regression behind one
// low pass, the delay d found by scanning and refined together with the gains. Source: "Motor System Identification",
// section 8, where a delay of 5 ms makes the difference.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "src/core/statistics.h"
#include "src/identify/filter.h"
#include "src/identify/regression.h"

namespace gapscope {
namespace {

struct Servo {
  std::vector<SmoothLog> smooth;
  std::vector<std::vector<double>> target, feedforward;  // per log, as logged
  std::vector<std::vector<double>> angle, torque;        // per log, on its grid
  std::vector<std::vector<char>> clipped;
  std::vector<std::vector<std::size_t>> missed;  // grid rows
  bool has_feedforward = false;
  std::string torque_unit;
  double ripple = 0;  // kp / inertia, 1/s^2: see MakeRows
};

// Rows in runs of three or more equal extreme values, or at the stated limit.
std::vector<char> Clipped(const std::vector<double>& torque, double limit) {
  std::vector<char> clipped(torque.size(), 0);
  if (torque.empty()) return clipped;
  const auto [lowest, highest] = std::minmax_element(torque.begin(), torque.end());
  for (std::size_t k = 0; k < torque.size(); ++k) {
    if (limit > 0) {
      clipped[k] = std::abs(torque[k]) >= 0.999 * limit ? 1 : 0;
      continue;
    }
    std::size_t end = k;
    while (end < torque.size() && torque[end] == torque[k] && (torque[k] == *lowest || torque[k] == *highest) &&
           *lowest < *highest)
      ++end;
    for (std::size_t r = k; end >= k + 3 && r < end; ++r) clipped[r] = 1;
    if (end > k) k = end - 1;
  }
  return clipped;
}

// How a logged torque relates to a target that is held from row to row. kStamped: read at the stamps, so just before
// each new target; seen a delay later it is one row's target or another's. kAveraged: read at any phase, so that on
// average the target is half a row old.
enum class Reading { kStamped, kAveraged };

Rows MakeRows(const Servo& servo, double delay_s, Reading reading, bool with_delay_column,
              const Eigen::VectorXd& gains) {
  std::vector<std::string> columns = {"error", "speed", "constant"};
  if (servo.has_feedforward) columns.push_back("feedforward");
  if (with_delay_column) columns.push_back("delay");
  Rows rows(columns);
  for (std::size_t log = 0; log < servo.smooth.size(); ++log) {
    const SmoothLog& smooth = servo.smooth[log];
    const auto held = [&](const std::vector<double>& values, int order) {
      return reading == Reading::kStamped
                 ? smooth.OnGrid(smooth.HeldBefore(values, delay_s), order)
                 : smooth.OnGrid(smooth.GridOf(values, true), order, delay_s + 0.5 * smooth.dt_s());
    };
    const std::vector<double> torque = smooth.OnGrid(servo.torque[log], 0), target = held(servo.target[log], 0),
                              angle = smooth.OnGrid(servo.angle[log], 0, delay_s),
                              speed = smooth.OnGrid(servo.angle[log], 1, delay_s);
    const std::vector<double> forward = servo.has_feedforward ? held(servo.feedforward[log], 0) : std::vector<double>();
    std::vector<double> target_rate, acceleration;
    std::vector<double> ripple(smooth.size(), 0.0);
    if (reading == Reading::kStamped && servo.ripple > 0) {
      // The staircase of targets makes the speed ripple between rows: at a phase s of a row it is off its mean by kp /
      // J target' (s dt/2 - s^2/2 - dt^2/12). Angles at the stamps give the mean speed, the law sees the one at t -
      // delay, whose row began a delay earlier still.
      const double dt = smooth.dt_s(), s = dt - std::fmod(2 * std::max(delay_s, 0.0), dt),
                   size = servo.ripple * (s * dt / 2 - s * s / 2 - dt * dt / 12);
      ripple = held(servo.target[log], 1);
      for (double& r : ripple) r *= size;
    }
    if (with_delay_column) {
      // A stamped target does not move with the delay, within a row.
      target_rate = reading == Reading::kStamped ? std::vector<double>(smooth.size(), 0.0) : held(servo.target[log], 1);
      acceleration = smooth.OnGrid(servo.angle[log], 2, delay_s);
    }
    std::vector<char> near_missed(smooth.size(), 0);
    for (const std::size_t m : servo.missed[log]) {
      for (std::size_t i = m - std::min(m, smooth.reach()); i <= std::min(m + smooth.reach(), smooth.size() - 1); ++i)
        near_missed[i] = 1;
    }
    for (std::size_t i = 0; i < smooth.size(); ++i) {
      if (!std::isfinite(torque[i]) || near_missed[i]) continue;
      bool clipped = false;
      for (std::size_t k = i - std::min(i, smooth.reach());
           k < std::min(smooth.size(), i + smooth.reach() + 1) && !clipped; ++k)
        clipped = servo.clipped[log][k] != 0;
      if (clipped) continue;
      std::vector<double> x = {target[i] - angle[i], -(speed[i] + ripple[i]), 1};
      if (servo.has_feedforward) x.push_back(forward[i]);
      if (with_delay_column) x.push_back(-(gains[0] * (target_rate[i] - speed[i]) - gains[1] * acceleration[i]));
      rows.Add(static_cast<int>(log), smooth.time_s(i), torque[i], x);
    }
  }
  return rows;
}

Result<Servo> LoadServo(const IdentifyInput& input, const IdentifyOptions& options) {
  GS_ASSIGN(const int joint, DrivenJoint(input.model, options.joint));
  const Experiment& experiment = input.model.experiment();
  const mjModel& m = input.model.compiled();
  Servo servo;
  for (const Recording& recording : input.recordings) {
    const Recording::Measured *angle = FindSignal(input.model, recording, SignalKind::kPosition, joint),
                              *torque = FindSignal(input.model, recording, SignalKind::kTorque, joint);
    if (!angle || !torque) {
      return Error{.what = "the law of a servo needs its angle and its torque (or duty)",
                   .where = recording.log_path,
                   .actual = angle ? "no torque column that the experiment binds" : "no angle",
                   .cure = "a measured signal of 'kind: torque' in " + experiment.path};
    }
    servo.torque_unit = torque->spec.unit;
    const std::vector<double>* target = nullptr;
    const std::vector<double>* forward = nullptr;
    for (std::size_t c = 0; c < experiment.commands.size(); ++c) {
      const int actuator = mj_name2id(&m, mjOBJ_ACTUATOR, experiment.commands[c].actuator.c_str());
      if (actuator < 0 || m.actuator_trntype[actuator] != mjTRN_JOINT || m.actuator_trnid[2 * actuator] != joint)
        continue;
      const auto& command = recording.commands[c];
      if (experiment.commands[c].kind == CommandKind::kAngle && !target) target = &command.values;
      const auto [low, high] = std::minmax_element(command.values.begin(), command.values.end());
      if (experiment.commands[c].kind == CommandKind::kTorque && *low < *high) forward = &command.values;
    }
    if (!target)
      return Error{.what = "no command of a target angle drives the joint",
                   .where = experiment.path,
                   .allowed = "a command with 'unit: rad'"};
    servo.smooth.emplace_back(recording, options);
    const SmoothLog& smooth = servo.smooth.back();
    servo.target.push_back(*target);
    servo.angle.push_back(smooth.GridOf(angle->values, false));
    servo.torque.push_back(smooth.GridOf(torque->values, false));
    servo.feedforward.push_back(forward ? *forward : std::vector<double>(recording.rows(), 0.0));
    servo.has_feedforward = servo.has_feedforward || forward != nullptr;
    servo.clipped.push_back(Clipped(servo.torque.back(), options.torque_limit));
    // Between two rows the torque jumps with the target: a missed tick cannot be interpolated.
    servo.missed.push_back(smooth.Missed());
  }
  return servo;
}

double RmseAt(const Servo& servo, double delay_s, Reading reading) {
  return ResidualRms(MakeRows(servo, delay_s, reading, false, {}));
}

// Gains of the thirds of rows with small, middle and large error.
PointTable ByErrorSize(const Servo& servo, double delay_s, Reading reading, double dt) {
  PointTable table{
      .name = "by_error",
      .columns = {"error_from_rad", "error_to_rad", "kp", "kp_low", "kp_high", "kd", "kd_low", "kd_high", "r2"},
      .rows = {}};
  const Rows all = MakeRows(servo, delay_s, reading, false, {});
  const Eigen::MatrixXd x = all.X();
  const Eigen::VectorXd y = all.Y();
  std::vector<double> envelope(all.size());
  // The largest error within a tenth of a second: an instant of zero error inside a large swing is not a small error.
  const std::size_t half = static_cast<std::size_t>(0.1 / dt);
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t k = i - std::min(i, half); k <= std::min(all.size() - 1, i + half); ++k)
      envelope[i] = std::max(envelope[i], std::abs(x(static_cast<Eigen::Index>(k), 0)));
  }
  std::vector<double> sorted = envelope;
  std::sort(sorted.begin(), sorted.end());
  for (int third = 0; third < 3; ++third) {
    const double low = sorted[sorted.size() * third / 3],
                 high = sorted[std::min(sorted.size() - 1, sorted.size() * (third + 1) / 3)];
    Rows part(all.columns());
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (envelope[i] < low || envelope[i] > high) continue;
      const auto at = static_cast<Eigen::Index>(i);
      const auto row = x.row(at);
      part.Add(all.logs()[i], all.times()[i], y[at], {row.begin(), row.end()});
    }
    const auto fit = Regress(part, dt);
    if (!fit.ok()) continue;
    const Regression& f = fit.value();
    table.rows.push_back({low, high, f.value[0], f.low[0], f.high[0], f.value[1], f.low[1], f.high[1], f.r2});
  }
  return table;
}

// What the torque accelerates, roughly.
double DrivenInertiaOf(const Servo& servo, double dt) {
  Rows rows({"acceleration", "speed", "constant"});
  for (std::size_t log = 0; log < servo.smooth.size(); ++log) {
    const SmoothLog& smooth = servo.smooth[log];
    const std::vector<double> torque = smooth.OnGrid(servo.torque[log], 0), speed = smooth.OnGrid(servo.angle[log], 1),
                              acceleration = smooth.OnGrid(servo.angle[log], 2);
    for (std::size_t i = 0; i < smooth.size(); ++i)
      rows.Add(static_cast<int>(log), smooth.time_s(i), torque[i], {acceleration[i], speed[i], 1});
  }
  const auto fit = Regress(rows, dt);
  return fit.ok() ? fit.value().value[0] : 0;
}

Status FindDelay(const Servo& servo, const IdentifyInput& input, const IdentifyOptions& options, PointTable* scan,
                 double* delay, Reading* reading) {
  const double dt = servo.smooth.front().dt_s();
  *scan = {.name = "delay_scan", .columns = {"delay_s", "rmse", "rmse_averaged"}, .rows = {}};
  double best = 0, best_rmse = INFINITY;
  for (double d = -0.875 * dt; d <= options.longest_delay_s; d += 0.25 * dt) {
    std::vector<double> row = {d};
    for (const Reading one : {Reading::kStamped, Reading::kAveraged}) {
      row.push_back(RmseAt(servo, d, one));
      if (row.back() < best_rmse) best = d, best_rmse = row.back(), *reading = one;
    }
    scan->rows.push_back(std::move(row));
  }
  if (!std::isfinite(best_rmse))
    return Error{.what = "no delay of the scan leaves rows to fit", .where = input.recordings.front().log_path};
  double a = best - 0.25 * dt, b = best + 0.25 * dt;
  if (*reading == Reading::kStamped) {
    const double row = std::floor(best / dt) * dt;
    a = std::max(a, row + 2e-6 * dt), b = std::min(b, row + dt - 2e-6 * dt);
  }
  constexpr double kGolden = 0.6180339887;
  double c = b - kGolden * (b - a), d = a + kGolden * (b - a), at_c = RmseAt(servo, c, *reading),
         at_d = RmseAt(servo, d, *reading);
  for (int i = 0; i < 24; ++i) {
    if (at_c < at_d) {
      b = d, d = c, at_d = at_c, c = b - kGolden * (b - a), at_c = RmseAt(servo, c, *reading);
    } else {
      a = c, c = d, at_c = at_d, d = a + kGolden * (b - a), at_d = RmseAt(servo, d, *reading);
    }
  }
  *delay = 0.5 * (a + b);
  return Ok();
}

// When a logged torque has seen a target.
struct Lateness {
  double delay_s = 0;
  Reading reading = Reading::kStamped;
  PointTable scan;
};

// Scans both readings, then golden section inside the best row: a stamped target jumps at whole rows. Twice: the first
// pass gives the ripple's size, which is put into `servo`.
Result<Lateness> FindLateness(const IdentifyInput& input, const IdentifyOptions& options, Servo* servo) {
  const double dt = servo->smooth.front().dt_s();
  Lateness late;
  for (const bool last : {false, true}) {
    GS_RETURN_IF_ERROR(FindDelay(*servo, input, options, &late.scan, &late.delay_s, &late.reading));
    if (last) break;
    GS_ASSIGN(const Regression rough, Regress(MakeRows(*servo, late.delay_s, late.reading, false, {}), dt));
    const double inertia = DrivenInertiaOf(*servo, dt);
    servo->ripple = inertia > 0 && rough.value[0] > 0 ? rough.value[0] / inertia : 0;
  }
  return late;
}

// Values of a regression with noise of the angle taken out of them.
struct Corrected {
  Eigen::VectorXd value, moved;  // moved: by the correction
  bool trusted = true;           // false: nothing was taken out, the noise is too large for it
};

// Noise of the angle is in error, speed and delay columns: what it does to the values is known from its variances,
// X'X/n holds too much of them.
Corrected WithoutNoise(const IdentifyInput& input, int joint, const IdentifyOptions& options, const Regression& fit,
                       const Eigen::MatrixXd& x, double dt) {
  const Eigen::MatrixXd moments = x.transpose() * x / static_cast<double>(x.rows());
  const double q = NoiseVariance(input, joint, 0, options), v = NoiseVariance(input, joint, 1, options),
               acceleration = NoiseVariance(input, joint, 2, options), kp = fit.value[0], kd = fit.value[1];
  const Eigen::Index delay_column = static_cast<Eigen::Index>(fit.value.size()) - 1;
  Eigen::MatrixXd noise = Eigen::MatrixXd::Zero(fit.value.size(), fit.value.size());
  noise(0, 0) = q, noise(1, 1) = v;
  noise(0, delay_column) = noise(delay_column, 0) = kd * v;
  noise(1, delay_column) = noise(delay_column, 1) = -kp * v;
  noise(delay_column, delay_column) = kp * kp * v + kd * kd * acceleration;
  Eigen::VectorXd corrected = (moments - noise).ldlt().solve(moments * fit.value);
  // Past a row's length the linear correction says nothing any more.
  const bool trusted = (moments - noise).ldlt().isPositive() && std::abs(corrected[delay_column]) < dt;
  if (!trusted) corrected = fit.value;
  // The scan has the delay already; a linear step farther than a row is a flat cost, not a better delay.
  if (std::abs(corrected[delay_column]) > dt) corrected[delay_column] = 0;
  return {.value = corrected, .moved = corrected - fit.value, .trusted = trusted};
}

// The law's values: since noise is known to about half, half of what was taken out is added to the intervals.
void AddLaw(const Servo& servo, const Regression& fit, const Corrected& corrected, double delay_s,
            Identification* result) {
  const bool duty = servo.torque_unit == "1";
  const auto add = [&](const char* name, const std::string& unit, Eigen::Index i, double start) {
    const double half = fit.high[i] - fit.value[i] + 0.5 * std::abs(corrected.moved[i]);
    const double value = start + corrected.value[i];
    result->values.push_back({.name = name, .unit = unit, .value = value, .low = value - half, .high = value + half});
  };
  add("kp", duty ? "1/rad" : servo.torque_unit + "/rad", 0, 0);
  add("kd", duty ? "s/rad" : servo.torque_unit + " s/rad", 1, 0);
  add("delay", "s", static_cast<Eigen::Index>(fit.value.size()) - 1, delay_s);
  add("offset", servo.torque_unit, 2, 0);
  if (servo.has_feedforward) add("feedforward_gain", "1", 3, 0);
}

// One inertia and nothing else: kp (q(t - d)) and kd dq(t - d) are, to first order in d, the same law with smaller
// gains. Only the target's row tells, so below about one row of delay the intervals reach to the values without.
void WidenBelowOneRow(const Regression& direct, double dt, Identification* result) {
  Estimate *gains = result->values.data(), &delay = result->values[2];
  if (!(delay.value < 1.5 * dt)) return;
  for (int i = 0; i < 2; ++i) {
    gains[i].low = std::min(gains[i].low, direct.low[i]);
    gains[i].high = std::max(gains[i].high, direct.high[i]);
  }
  delay.low = std::min(delay.low, 0.0);
  result->remarks.push_back(
      "a delay below about one row cannot be told from smaller gains: the intervals reach to the values without "
      "delay");
}

void RemarkClippedRows(const Servo& servo, Identification* result) {
  std::size_t clipped = 0, total = 0;
  for (const auto& rows : servo.clipped)
    clipped += static_cast<std::size_t>(std::count(rows.begin(), rows.end(), 1)), total += rows.size();
  if (clipped > 0)
    result->remarks.push_back(std::to_string(100 * clipped / total) + " % of the rows are at a limit and left out");
}

}  // namespace

Result<Identification> IdentifyPd(const IdentifyInput& input, const IdentifyOptions& options) {
  GS_ASSIGN(Servo servo, LoadServo(input, options));
  const double dt = servo.smooth.front().dt_s();
  GS_ASSIGN(const Regression direct, Regress(MakeRows(servo, 0, Reading::kStamped, false, {}), dt));
  GS_ASSIGN(Lateness late, FindLateness(input, options, &servo));
  GS_ASSIGN(const Regression at_delay, Regress(MakeRows(servo, late.delay_s, late.reading, false, {}), dt));
  // The delay as one more column: its interval, and what not knowing it costs the gains.
  const Rows rows = MakeRows(servo, late.delay_s, late.reading, true, at_delay.value);
  GS_ASSIGN(const Regression fit, Regress(rows, dt));
  GS_ASSIGN(const int joint, DrivenJoint(input.model, options.joint));
  const Corrected corrected = WithoutNoise(input, joint, options, fit, rows.X(), dt);

  Identification result{.method = "pd",
                        .relation = "torque(t) = kp (target - angle)(t - delay) - kd speed(t - delay) + offset",
                        .r2 = at_delay.r2,
                        .rmse = at_delay.rmse,
                        .unit = servo.torque_unit,
                        .rows = at_delay.rows};
  AddLaw(servo, fit, corrected, late.delay_s, &result);
  const std::string gain = result.values[0].unit, damping = result.values[1].unit;
  WidenBelowOneRow(direct, dt, &result);
  result.values.push_back(ToEstimate(direct, 0, "kp_without_delay", gain));
  result.values.push_back(ToEstimate(direct, 1, "kd_without_delay", damping));
  result.values.push_back({.name = "r2_without_delay", .unit = "1", .value = direct.r2, .low = kNaN, .high = kNaN});
  if (!corrected.trusted)
    result.remarks.push_back(
        "noise of the angle moves the values by more than can be corrected: a larger motion, or a lower --cutoff");
  result.tables = {std::move(late.scan), ByErrorSize(servo, late.delay_s, late.reading, dt)};
  if (result.r2 < 0.9)
    result.remarks.push_back(
        "the law explains less than 90 % of the torque's variance: dry friction, a limit or another law");
  if (late.delay_s > options.longest_delay_s - dt)
    result.remarks.push_back("the delay is at the end of the scan: raise --longest-delay");
  const PointTable& parts = result.tables.back();
  if (parts.rows.size() == 3 && std::abs(parts.rows[0][2] - at_delay.value[0]) > 0.1 * std::abs(at_delay.value[0])) {
    result.remarks.push_back(
        "with small errors the gain comes out by more than a tenth different: excite with larger errors");
  }
  RemarkClippedRows(servo, &result);
  return result;
}

}  // namespace gapscope
