#include "tests/twin/recorder.h"

#include <algorithm>
#include <cmath>

#include "tests/twin/random.h"

namespace gapscope::twin {
namespace {

constexpr double kLoopFilter_s = 0.02;  // of the weak loop's speed
constexpr double kSpeedQuantum = 0.001, kTorqueQuantum = 0.02, kCurrentQuantum = 0.001;

// The angles of the past at every substep, for a late sensor.
class Past {
 public:
  Past(double step_s, bool keep) : step_s_(step_s), keep_(keep) {}
  void Push(const Simulator& simulator) {
    if (keep_) past_.push_back({simulator.q1(), simulator.q2()});
  }
  double At(int signal, double time_s) const {
    const double at = std::clamp(time_s / step_s_, 0.0, static_cast<double>(past_.size() - 1));
    const auto i = std::min(static_cast<std::size_t>(at), past_.size() - 1);
    const auto next = std::min(i + 1, past_.size() - 1);
    const auto s = static_cast<std::size_t>(signal);
    return past_[i][s] + (at - static_cast<double>(i)) * (past_[next][s] - past_[i][s]);
  }

 private:
  double step_s_;
  bool keep_;
  std::vector<std::array<double, 2>> past_;
};

// What is wrong in the sensors and outside the list.
class SensorFaults {
 public:
  explicit SensorFaults(const Outside& outside) : outside_(outside) {}
  double Apply(int signal, double angle, double time_s) {
    double seen = angle;
    if (outside_.play_rad > 0 && signal == outside_.play_signal) {
      seen = held_ = std::clamp(held_, angle - outside_.play_rad / 2, angle + outside_.play_rad / 2);
    }
    if (signal == outside_.drift_signal) seen *= 1 + outside_.scale_drift_per_s * time_s;
    if (signal == 0) seen += outside_.wheel_error_rad * std::sin(angle + outside_.wheel_phase_rad);
    return seen;
  }

 private:
  Outside outside_;
  double held_ = 0;
};

std::vector<std::string> ColumnNames(Rig rig, const LogSpec& log) {
  const RigNames& names = Names(rig);
  std::vector<std::string> columns = {"time_s", names.command, names.first_signal};
  if (rig != Rig::kJoint) columns.push_back(names.second_signal);
  if (rig == Rig::kJoint) {
    if (log.speed_column) columns.push_back("velocity_rad_per_s");
    if (log.torque_column) columns.push_back("torque_n_m");
    if (log.feedforward_column) columns.push_back("feedforward_n_m");
  }
  if (rig == Rig::kQube && log.current_column) columns.push_back("current_a");
  return columns;
}

// Rows that are missing from the log: single ticks that the controller missed, and bursts that only the logger lost.
struct Losses {
  std::vector<char> missed, unlogged;
};
Losses DrawLosses(const LogSpec& log, const Outside& outside, std::size_t rows, Random* random) {
  Losses losses{std::vector<char>(rows, 0), std::vector<char>(rows, 0)};
  for (std::size_t k = 1; k + 1 < rows; ++k) losses.missed[k] = random->Chance(log.dropped_share);
  for (int burst = 0; burst < outside.bad_stamp_bursts; ++burst) {
    const auto first = static_cast<std::size_t>(random->Uniform(0.1, 0.8) * static_cast<double>(rows));
    for (int k = 0; k < outside.bad_stamp_rows; ++k) losses.unlogged[std::min(first + k, rows - 2)] = 1;
  }
  return losses;
}

}  // namespace

double Rounded(double value, double quantum) { return quantum > 0 ? quantum * std::round(value / quantum) : value; }

double Late(const Drive& drive, double jitter) {
  return std::max(0.0, drive.command_delay_s * (1 + std::clamp(drive.jitter * jitter, -0.5, 0.5)));
}

double Sensor::Floor() const {
  return std::sqrt(white_rad * white_rad + coloured_rad * coloured_rad + resolution_rad * resolution_rad / 12);
}

Encoder::Encoder(const Sensor& sensor, double period_s, bool noise, Random* random)
    : sensor_(sensor), noise_(noise), random_(random), keep_(std::exp(-period_s / sensor.colour_time_s)) {
  if (noise) colour_ = sensor.coloured_rad * random->Normal();
}

double Encoder::Read(double angle_rad) {
  if (!noise_) return angle_rad;
  colour_ = keep_ * colour_ + sensor_.coloured_rad * std::sqrt(1 - keep_ * keep_) * random_->Normal();
  const double noisy = angle_rad + sensor_.offset_rad + colour_ + sensor_.white_rad * random_->Normal();
  return Rounded(noisy, sensor_.resolution_rad);
}

Commands Received(const Record& record, const Plant& plant) {
  Commands commands;
  commands.time_s = record.time_s;
  commands.value = record.command;
  commands.feedforward_n_m = record.feedforward_n_m;
  commands.delay_s.reserve(record.jitter.size());
  for (const double jitter : record.jitter) commands.delay_s.push_back(Late(plant.drive, jitter));
  return commands;
}

Record MakeRecord(const Plant& plant, const LogSpec& log, const Sensors& sensors, const RecordOptions& options) {
  Random random(log.seed, 0, "log");
  Random draws(log.seed, 1, "drops");
  const double period = 1 / log.rate_hz;
  const auto rows = static_cast<std::size_t>(std::llround(log.excitation.duration_s * log.rate_hz)) + 1;
  const auto substeps = static_cast<int>(std::llround(period / options.step_s));
  const double step = period / substeps;
  const int signals = SignalCount(plant.rig);
  const Outside& outside = plant.outside;
  const Losses losses = DrawLosses(log, outside, rows, &draws);
  const std::size_t snapshot_rows =
      options.snapshot_every_s > 0 ? static_cast<std::size_t>(std::llround(options.snapshot_every_s / period)) : 0;

  Record record;
  record.names = ColumnNames(plant.rig, log);
  Simulator simulator(plant, step);
  simulator.Place(log.start[0], log.start[1], log.start[2], log.start[3]);
  simulator.SetSession(log.session_s);
  const bool late = plant.sensor_delay_s[0] > 0 || plant.sensor_delay_s[1] > 0;
  Past past(step, late);
  past.Push(simulator);
  std::array<Encoder, 2> encoder = {Encoder(sensors.angle[0], period, options.noise, &random),
                                    Encoder(sensors.angle[1], period, options.noise, &random)};
  SensorFaults faults(outside);
  Commands commands;
  double loop_speed = 0, loop_angle = 0, hold_until = -1;
  long lost = 0;

  for (std::size_t k = 0; k < rows; ++k) {
    const double t = static_cast<double>(k) * period;
    // What the encoders show: now for the loop, and later for the log when a sensor is late.
    const std::array<double, 2> now = {simulator.q1(), simulator.q2()};
    std::array<double, 2> shown = now, read{};
    for (int s = 0; s < signals; ++s) {
      if (plant.sensor_delay_s[s] > 0) shown[s] = past.At(s, t - plant.sensor_delay_s[s]);
      shown[s] = faults.Apply(s, shown[s], t);
      read[s] = encoder[s].Read(shown[s]);
    }

    const double excited = log.amplitude * log.excitation.At(t);
    double u = log.as_reference ? 0.0 : excited;
    if (log.loop.On()) {
      const double angle = now[0] + (read[0] - shown[0]);  // the loop's own reading is on time
      if (k == 0) loop_angle = angle;
      const double rate = (angle - loop_angle) / period;
      loop_speed += (1 - std::exp(-period / kLoopFilter_s)) * (rate - loop_speed);
      loop_angle = angle;
      u += log.loop.kp_per_rad * ((log.as_reference ? excited : 0.0) - angle) - log.loop.kd_per_rad_per_s * loop_speed;
    }
    u = std::clamp(u, -log.command_limit, log.command_limit);
    const double feed = log.feedforward_n_m * log.feedforward.At(t);

    if (outside.hold_per_s > 0 && t > hold_until && draws.Chance(outside.hold_per_s * period)) {
      hold_until = t + outside.hold_time_s;
    }
    const double jitter = draws.Normal();
    const bool held = k > 0 && (losses.missed[k] != 0 || t < hold_until);
    commands.Add(t, held ? commands.value.back() : u, held ? commands.feedforward_n_m.back() : feed,
                 Late(plant.drive, jitter));

    // Noise is drawn for every row, so that a lost row changes no other.
    const auto noisy = [&](double value, double offset, double deviation, double quantum) {
      return options.noise ? Rounded(value + offset + deviation * random.Normal(), quantum) : value;
    };
    const DriveOutput& drive = simulator.drive();
    const double speed = noisy(simulator.w1(), 0, sensors.speed_noise_rad_per_s, kSpeedQuantum);
    const double torque =
        noisy(drive.estimate_n_m, sensors.torque_offset_n_m, sensors.torque_noise_n_m, kTorqueQuantum);
    const double current = noisy(drive.current_a, sensors.current_offset_a, sensors.current_noise_a, kCurrentQuantum);
    if (losses.unlogged[k] != 0) ++lost;
    if (losses.missed[k] == 0 && losses.unlogged[k] == 0) {
      const double stamp = t - static_cast<double>(lost) * period + outside.clock_drift_per_s * t * t / 2;
      if (snapshot_rows > 0 && record.time_s.size() % snapshot_rows == 0 && k + 1 < rows) {
        record.snapshots.push_back(simulator);
        record.snapshots.back().SetTime(stamp);
        record.snapshot_rows.push_back(record.time_s.size());
      }
      record.time_s.push_back(stamp);
      record.command.push_back(u);
      record.feedforward_n_m.push_back(feed);
      record.jitter.push_back(jitter);
      record.angle_rad.push_back(shown);
      record.drive.push_back(drive);
      record.motion.push_back({simulator.q1(), simulator.w1(), simulator.q2(), simulator.w2()});
      std::vector<double> row = {stamp, u, read[0]};
      if (signals > 1) row.push_back(read[1]);
      if (plant.rig == Rig::kJoint) {
        if (log.speed_column) row.push_back(speed);
        if (log.torque_column) row.push_back(torque);
        if (log.feedforward_column) row.push_back(feed);
      }
      if (plant.rig == Rig::kQube && log.current_column) row.push_back(current);
      record.rows.push_back(std::move(row));
    }

    for (int i = 0; i < substeps; ++i) {
      simulator.Step(commands);
      past.Push(simulator);
    }
  }
  return record;
}

}  // namespace gapscope::twin
