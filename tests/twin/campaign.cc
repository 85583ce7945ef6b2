#include "tests/twin/campaign.h"

#include <algorithm>
#include <cmath>

namespace gapscope::twin {
namespace {

constexpr double kSizingStep_s = 5e-4;

RecordOptions Sizing() {
  RecordOptions options;
  options.step_s = kSizingStep_s;
  options.noise = false;
  return options;
}

double DefaultLow(Rig rig) { return rig == Rig::kJoint ? 0.1 : 0.4; }

// One style of each kind first, then any: a campaign holds fast, slow and stepping motions.
LogStyle DrawStyle(Rig rig, int number, bool loop_always, Random* random) {
  LogStyle style;
  style.envelope = DrawEnvelope(rig, random);
  const bool joint = rig == Rig::kJoint;
  const int kind = number < 3 ? number : random->Integer(0, 2);
  style.loop = !joint && (loop_always || random->Chance(0.5));
  const double top = joint ? random->Uniform(5, 15) : random->Uniform(5, 14);
  if (kind == 0) {  // fast and broad
    style.shape = random->Chance(0.55) ? Shape::kChirp : Shape::kMultisine;
    // Without a loop the lowest tones would take all of the angle and leave little drive for the rest.
    style.low_hz = DefaultLow(rig) * (style.loop || joint ? random->Uniform(1, 2) : random->Uniform(1.2, 3.5));
    style.high_hz = top;
  } else if (kind == 1) {  // slow, or of growing amplitude
    constexpr Shape kSlow[] = {Shape::kTriangle, Shape::kRamps, Shape::kSwept};
    style.shape = kSlow[random->Integer(0, 2)];
    style.loop = !joint;
    style.as_reference = !joint;
    style.low_hz = 0.2;
    style.high_hz = 1.0;
    if (!joint && style.shape == Shape::kSwept && random->Chance(0.5)) {
      style.as_reference = false;
      style.loop = loop_always || random->Chance(0.5);
      style.low_hz = 0.8;
      style.high_hz = 2.5;
    }
  } else {  // jumps
    style.shape = random->Chance(0.5) ? Shape::kSteps : Shape::kSquare;
    style.low_hz = joint ? 0.4 : 0.8;
    style.high_hz = 2.5;
    style.as_reference = !joint && (style.shape == Shape::kSteps || random->Chance(0.4));
    style.loop = style.loop || style.as_reference;
    if (style.as_reference) style.low_hz = 0.3;
  }
  return style;
}

}  // namespace

Envelope Tolerable(Rig rig) {
  switch (rig) {
    case Rig::kJoint:
      return {3.5, kNever, 14.5, kNever, kNever};
    case Rig::kQube:
      return {4.5, 2.4, kNever, kNever, kNever};
    case Rig::kFlexJoint:
      return {5.0, 0.9, kNever, kNever, kNever};
    case Rig::kFlexLink:
      break;
  }
  return {5.0, 0.8, kNever, kNever, kNever};
}

Envelope DrawEnvelope(Rig rig, Random* random) {
  switch (rig) {
    case Rig::kJoint:
      return {random->LogUniform(0.15, 1.6), kNever, random->Uniform(4, 12.1), kNever, random->Uniform(40, 115)};
    case Rig::kQube:
      return {random->Uniform(0.6, 1.6), random->Uniform(0.5, 1.5), kNever, random->Uniform(5, 10), kNever};
    case Rig::kFlexJoint:
      return {random->Uniform(0.8, 2.2), random->Uniform(0.25, 0.55), kNever, random->Uniform(5, 10), kNever};
    case Rig::kFlexLink:
      break;
  }
  return {random->Uniform(0.8, 2.2), random->Uniform(0.2, 0.5), kNever, random->Uniform(1.2, 3), kNever};
}

WeakLoop DrawLoop(Rig rig, Random* random) {
  switch (rig) {
    case Rig::kQube:
      return {random->Uniform(2, 5), random->Uniform(0.15, 0.35)};
    case Rig::kFlexJoint:
      return {random->Uniform(3, 7), random->Uniform(0.0, 0.1)};
    case Rig::kFlexLink:
      return {random->Uniform(0.3, 0.8), random->Uniform(0.02, 0.06)};
    case Rig::kJoint:
      break;
  }
  return {};
}

bool Peaks::Within(const Envelope& e) const {
  return angle1_rad <= e.angle1_rad && angle2_rad <= e.angle2_rad && speed1_rad_per_s <= e.speed1_rad_per_s &&
         command <= e.command && torque_n_m <= e.torque_n_m;
}

Peaks PeaksOf(const Plant& plant, const LogSpec& log) {
  LogSpec clean = log;
  clean.dropped_share = 0;
  const Record record = MakeRecord(plant, clean, Sensors{}, Sizing());
  Peaks peaks;
  for (std::size_t i = 0; i < record.time_s.size(); ++i) {
    const auto grow = [](double* peak, double value) {
      *peak = std::isfinite(value) ? std::max(*peak, std::abs(value)) : kNever;
    };
    grow(&peaks.angle1_rad, record.angle_rad[i][0]);
    grow(&peaks.angle2_rad, record.angle_rad[i][1]);
    grow(&peaks.command, record.command[i]);
    grow(&peaks.torque_n_m, record.drive[i].estimate_n_m);
    if (i > 0) {
      grow(&peaks.speed1_rad_per_s, (record.angle_rad[i][0] - record.angle_rad[i - 1][0]) * log.rate_hz);
    }
  }
  return peaks;
}

Sensor DrawSensor(Random* random) {
  Sensor sensor;
  sensor.offset_rad = random->Uniform(-0.01, 0.01);
  sensor.white_rad = random->LogUniform(3e-5, 5e-4);
  sensor.coloured_rad = random->LogUniform(3e-5, 7e-4);
  sensor.colour_time_s = random->LogUniform(0.004, 0.06);
  return sensor;
}

Sensors DrawSensors(Rig rig, Random* random) {
  Sensors sensors;
  for (int s = 0; s < SignalCount(rig); ++s) {
    Sensor& sensor = sensors.angle[static_cast<std::size_t>(s)];
    sensor = DrawSensor(random);
    double counts = 4096;
    if (rig == Rig::kJoint) counts = std::exp2(random->Integer(14, 16));
    if (rig == Rig::kQube) counts = 2048;
    if (rig == Rig::kFlexLink && s == 1) counts = random->Uniform(20000, 60000);
    sensor.resolution_rad = kTurn / counts;
  }
  sensors.speed_noise_rad_per_s = random->LogUniform(0.005, 0.03);
  sensors.torque_noise_n_m = random->LogUniform(0.05, 0.3);
  sensors.current_noise_a = random->LogUniform(0.003, 0.015);
  sensors.current_offset_a = random->Uniform(-0.02, 0.02);
  return sensors;
}

Base DrawBase(Rig rig, Random* random) {
  Base base = NominalBase(rig);
  for (const BaseParameter& p : BaseParameters(rig)) {
    base.*p.field *= 1 + p.relative_spread * random->Uniform(-1, 1);
  }
  if (VoltageDriven(rig)) base.km_v_s_per_rad = base.kt_n_m_per_a * random->Uniform(0.98, 1.02);  // equal in SI, nearly
  return base;
}

LogSpec MakeLog(const Plant& plant, const LogStyle& style, double duration_s, double rate_hz, Random* random) {
  LogSpec log;
  log.excitation = MakeExcitation(style.shape, duration_s, style.low_hz, style.high_hz, random);
  log.as_reference = style.as_reference;
  // A square wave that starts in the middle of a half does not carry an integrating plant away.
  if (style.shape == Shape::kSquare && !style.as_reference && plant.rig != Rig::kJoint) log.excitation.phase = 0.25;
  if (style.loop) log.loop = DrawLoop(plant.rig, random);
  if (VoltageDriven(plant.rig)) log.command_limit = 10;
  if (plant.rig == Rig::kFlexLink) log.command_limit = 3;
  log.rate_hz = rate_hz;
  log.seed = static_cast<std::uint64_t>(random->Unit() * 0x1.0p53);
  log.dropped_share = random->Chance(0.5) ? random->LogUniform(2e-4, 3e-3) : 0;
  const bool joint = plant.rig == Rig::kJoint;
  log.start = {random->Uniform(-0.02, 0.02), joint ? 0.0 : random->Uniform(-0.05, 0.05), 0, 0};
  if (plant.rig == Rig::kQube) {
    log.start[2] = random->Uniform(-0.1, 0.1);
    log.start[3] = random->Uniform(-0.3, 0.3);
  } else if (!joint) {
    log.start[2] = random->Uniform(-0.005, 0.005);
  }
  // The largest amplitude that stays within the envelope.
  double high = joint ? 1.6 : style.as_reference ? 2.5 : plant.rig == Rig::kFlexLink ? 3.0 : 10.0;
  double low = 0;
  log.amplitude = high;
  if (!PeaksOf(plant, log).Within(style.envelope)) {
    for (int i = 0; i < 9; ++i) {
      log.amplitude = (low + high) / 2;
      (PeaksOf(plant, log).Within(style.envelope) ? low : high) = log.amplitude;
    }
    log.amplitude = std::max(low, high / 8);
  }
  return log;
}

std::vector<LogSpec> DrawCampaign(const Plant& plant, bool loop_always, Random* random) {
  constexpr double kRates[] = {200, 250, 500, 1000};
  const double rate = kRates[random->Integer(0, 3)];
  const int count = random->Integer(3, 6);
  const bool joint = plant.rig == Rig::kJoint;
  const bool speed = joint && random->Chance(0.6), torque = joint && random->Chance(0.65);
  const bool feed = joint && random->Chance(0.25), current = plant.rig == Rig::kQube && random->Chance(0.4);
  std::vector<LogSpec> logs;
  for (int i = 0; i < count; ++i) {
    const LogStyle style = DrawStyle(plant.rig, i, loop_always, random);
    LogSpec log = MakeLog(plant, style, std::round(random->Uniform(5, 10)), rate, random);
    log.speed_column = speed;
    log.torque_column = torque;
    log.feedforward_column = feed;
    log.current_column = current;
    if (feed && random->Chance(0.7)) {
      log.feedforward = MakeExcitation(Shape::kMultisine, log.excitation.duration_s, 0.3, 6, random);
      log.feedforward_n_m = random->Uniform(3, 15);
    }
    logs.push_back(log);
  }
  return logs;
}

bool Tame(const Plant& plant, LogSpec* log, Random* random) {
  const Envelope tolerable = Tolerable(plant.rig);
  for (int i = 0; i < 8; ++i) {
    if (PeaksOf(plant, *log).Within(tolerable)) return true;
    if (plant.rig != Rig::kJoint && !log->loop.On()) {
      log->loop = DrawLoop(plant.rig, random);
    } else {
      log->amplitude *= 0.75;
    }
  }
  return false;
}

Motion MotionOf(const Plant& plant, const std::vector<LogSpec>& logs) {
  Motion motion;
  double torque2 = 0, speed_squares = 0, torque_squares = 0, count = 0;
  for (const LogSpec& log : logs) {
    const Record record = MakeRecord(plant, log, Sensors{}, Sizing());
    const Base& b = plant.base;
    for (std::size_t i = 1; i < record.time_s.size(); ++i) {
      const DriveOutput& drive = record.drive[i];
      const double dt = record.time_s[i] - record.time_s[i - 1];
      const double w1 = (record.angle_rad[i][0] - record.angle_rad[i - 1][0]) / dt;
      const double w2 = (record.angle_rad[i][1] - record.angle_rad[i - 1][1]) / dt;
      const double q2 = record.angle_rad[i][1];
      const auto grow = [](double* peak, double value) { *peak = std::max(*peak, std::abs(value)); };
      grow(&motion.torque_peak_n_m, drive.torque_n_m);
      grow(&motion.command_peak, drive.effort);
      if (drive.torque_n_m * w1 > 0) grow(&motion.power_peak_w, drive.torque_n_m * w1);
      grow(&motion.angle1_peak_rad, record.angle_rad[i][0]);
      grow(&motion.speed1_peak_rad_per_s, w1);
      grow(&motion.angle2_peak_rad, q2);
      grow(&motion.speed2_peak_rad_per_s, w2);
      const double spring = plant.rig == Rig::kQube
                                ? b.pendulum_mass_kg * b.gravity_m_per_s2 * b.pendulum_length_m / 2 * std::sin(q2)
                                : b.link_stiffness_n_m_per_rad * q2;
      torque2 += spring * spring;
      torque_squares += drive.torque_n_m * drive.torque_n_m;
      speed_squares += w1 * w1;
      ++count;
    }
  }
  motion.torque_rms_n_m = std::sqrt(torque_squares / count);
  motion.torque2_rms_n_m = std::sqrt(torque2 / count);
  motion.speed1_rms_rad_per_s = std::sqrt(speed_squares / count);
  return motion;
}

}  // namespace gapscope::twin
