#include "tests/twin/arm/recorder.h"

#include <algorithm>
#include <cmath>

#include "tests/twin/campaign.h"
#include "tests/twin/case.h"

namespace gapscope::twin {
namespace {

constexpr double kSettle_s = 1.5;  // at the first targets, before a log
constexpr double kArmSizing_s = 1e-3;
constexpr double kArmTorqueQuantum = 1e-3, kMotionSample_s = 0.005;
constexpr double kTolerableSpeed = 12, kTolerableTorque = 4, kTolerableTurn_rad = 3;  // rad/s, rated torques, from home
constexpr int kLogs = 4;

RecordOptions ArmSizing() {
  RecordOptions options;
  options.step_s = kArmSizing_s;
  options.noise = false;
  return options;
}

std::vector<std::string> ColumnNames(ArmRig rig, bool torques) {
  std::vector<std::string> names = {"time_s"};
  for (const ArmLink& link : ArmLinks(rig)) names.push_back(link.joint + "_target_rad");
  for (const ArmLink& link : ArmLinks(rig)) names.push_back(link.Signal());
  for (const ArmLink& link : ArmLinks(rig)) {
    if (torques) names.push_back(link.joint + "_torque_n_m");
  }
  return names;
}

// Largest speed and largest share of the rated torque of any joint; the largest turn from home.
struct ArmPeaks {
  double speed = 0, torque = 0, turn_rad = 0;
};
ArmPeaks PeaksOfArm(const ArmPlant& plant, const ArmLog& log) {
  ArmLog clean = log;
  clean.dropped_share = 0;
  const ArmRecord record = MakeArmRecord(plant, clean, ArmSensors{}, ArmSizing());
  const auto& links = ArmLinks(plant.rig);
  ArmPeaks peaks;
  const auto grow = [](double* peak, double value) {
    *peak = std::isfinite(value) ? std::max(*peak, std::abs(value)) : kNever;
  };
  for (std::size_t i = 0; i < record.time_s.size(); ++i) {
    for (int j = 0; j < plant.count(); ++j) {
      grow(&peaks.speed, record.w_rad_per_s[i][j]);
      grow(&peaks.torque, record.torque_n_m[i][j] / links[static_cast<std::size_t>(j)].rated_n_m);
      grow(&peaks.turn_rad, record.q_rad[i][j] - log.home_rad[j]);
    }
  }
  return peaks;
}

// What a log of each kind drives the joints with.
Excitation DrawJointExcitation(int kind, Shape shape, double duration_s, Random* random) {
  if (kind == 0) return MakeExcitation(shape, duration_s, random->Uniform(0.1, 0.3), random->Uniform(2, 4.5), random);
  if (kind == 1) return MakeExcitation(shape, duration_s, random->Uniform(0.08, 0.15), 0.4, random);
  return MakeExcitation(shape, duration_s, random->Uniform(0.25, 0.4), 1.2, random);
}

Shape DrawShape(int kind, Random* random) {
  constexpr Shape kSlow[] = {Shape::kTriangle, Shape::kRamps, Shape::kSwept};
  if (kind == 0) return random->Chance(0.35) ? Shape::kChirp : Shape::kMultisine;
  if (kind == 1) return kSlow[random->Integer(0, 2)];
  return random->Chance(0.6) ? Shape::kSteps : Shape::kSquare;
}

ArmLog DrawArmLog(const ArmPlant& plant, int kind, Random* random) {
  const auto& links = ArmLinks(plant.rig);
  const Shape shape = DrawShape(kind, random);
  ArmLog log;
  log.home_rad = log.amplitude_rad = JointVector::Zero(plant.count());
  for (int j = 0; j < plant.count(); ++j) {
    const ArmLink& link = links[static_cast<std::size_t>(j)];
    log.excitation.push_back(DrawJointExcitation(kind, shape, log.duration_s, random));
    log.home_rad[j] = link.home_rad + random->Uniform(-0.15, 0.15);
    log.amplitude_rad[j] = link.reach_rad * random->Uniform(0.4, 1.0) * (kind == 2 ? 0.6 : 1.0);
  }
  log.seed = static_cast<std::uint64_t>(random->Unit() * 0x1.0p53);
  log.dropped_share = random->Chance(0.5) ? random->LogUniform(2e-4, 3e-3) : 0;
  const double speed = random->Uniform(2, 5), torque = random->Uniform(1, 1.8);
  double low = 0.1, high = 1;
  for (int i = 0; i < 7; ++i) {
    const ArmPeaks peaks = PeaksOfArm(plant, log);
    (peaks.speed <= speed && peaks.torque <= torque ? low : high) = log.scale;
    if (low == 1) break;
    log.scale = std::sqrt(low * high);
  }
  log.scale = low;
  return log;
}

}  // namespace

double JointHistory::At(int joint, double step) const {
  const double at = std::clamp(step, 0.0, static_cast<double>(past_.size() - 1));
  const auto low = static_cast<std::size_t>(at);
  const auto high = std::min(low + 1, past_.size() - 1);
  return past_[low][joint] + (at - static_cast<double>(low)) * (past_[high][joint] - past_[low][joint]);
}

ArmCommands ReceivedByArm(const ArmRecord& record, const ArmPlant& plant) {
  ArmCommands commands(plant.joints.size());
  for (int j = 0; j < plant.count(); ++j) {
    for (std::size_t k = 0; k < record.time_s.size(); ++k) {
      commands[j].Add(record.time_s[k], record.target_rad[k][j], 0, Late(plant.joints[j].drive, record.jitter[k]));
    }
  }
  return commands;
}

namespace {

// One log being made.
class ArmRecorder {
 public:
  ArmRecorder(const ArmPlant& plant, const ArmLog& log, const ArmSensors& sensors, const RecordOptions& options)
      : plant_(plant),
        log_(log),
        sensors_(sensors),
        options_(options),
        period_s_(1 / log.rate_hz),
        substeps_(static_cast<int>(std::llround(period_s_ / options.step_s))),
        noise_(log.seed, 0, "log"),
        draws_(log.seed, 1, "drops"),
        simulator_(plant, period_s_ / substeps_),
        commands_(plant.joints.size()) {
    for (int j = 0; j < plant.count(); ++j) {
      const auto s = static_cast<std::size_t>(j);
      encoders_.emplace_back(s < sensors.angle.size() ? sensors.angle[s] : Sensor(), period_s_, options.noise, &noise_);
    }
    late_ = std::any_of(plant.joints.begin(), plant.joints.end(),
                        [](const ArmJoint& joint) { return joint.sensor_delay_s > 0; });
    const auto least =
        std::min_element(plant.joints.begin(), plant.joints.end(),
                         [](const ArmJoint& a, const ArmJoint& b) { return a.sensor_delay_s < b.sensor_delay_s; });
    log_late_s_ = least->sensor_delay_s;
    record_.names = ColumnNames(plant.rig, log.torque_columns);
  }

  ArmRecord Make() {
    Settle();
    const auto rows = static_cast<std::size_t>(std::llround(log_.duration_s * log_.rate_hz)) + 1;
    for (std::size_t k = 0; k < rows; ++k) {
      Row(k, k > 0 && k + 1 < rows && draws_.Chance(log_.dropped_share), k + 1 == rows);
      for (int i = 0; i < substeps_; ++i) {
        simulator_.Step(commands_);
        if (late_) Remember();
      }
    }
    return std::move(record_);
  }

 private:
  JointVector Targets(double time_s) const {
    JointVector target(plant_.count());
    for (int j = 0; j < plant_.count(); ++j) target[j] = log_.TargetOf(j, time_s);
    return target;
  }

  void Settle() {
    const JointVector target = Targets(0);
    ArmCommands still(plant_.joints.size());
    for (int j = 0; j < plant_.count(); ++j) still[j].Add(0, target[j], 0, 0);
    simulator_.SetSession(log_.session_s);
    simulator_.Place(target, JointVector::Zero(plant_.count()));
    simulator_.SetTime(-kSettle_s);
    const auto steps = static_cast<int>(std::llround(kSettle_s / simulator_.step_s()));
    for (int i = 0; i < steps; ++i) simulator_.Step(still);
    simulator_.SetTime(0);
    Remember();
  }

  void Remember() {
    history_.Push(simulator_.q());
    torque_history_.Push(simulator_.estimate_n_m());
  }

  // What the sensors show at row k, and what is sent there. A missed tick is no row, and the arm keeps the old targets.
  void Row(std::size_t k, bool missed, bool last) {
    const double t = static_cast<double>(k) * period_s_;
    const JointVector target = Targets(t);
    const double jitter = draws_.Normal();
    JointVector shown = simulator_.q();
    std::vector<double> row = {t};
    for (int j = 0; j < plant_.count(); ++j) {
      const double late = plant_.joints[j].sensor_delay_s;
      if (late > 0) shown[j] = history_.At(j, (t - late) / simulator_.step_s());
      const double sent = missed ? commands_[j].value.back() : target[j];
      commands_[j].Add(t, sent, 0, Late(plant_.joints[j].drive, jitter));
      row.push_back(target[j]);
    }
    for (int j = 0; j < plant_.count(); ++j) row.push_back(encoders_[j].Read(shown[j]));
    for (int j = 0; j < plant_.count(); ++j) {
      const double noise = sensors_.torque_noise * ArmLinks(plant_.rig)[j].rated_n_m * noise_.Normal();
      const double late = log_late_s_ / simulator_.step_s(), now = t / simulator_.step_s();
      const double estimate = late > 0 ? torque_history_.At(j, now - late) : simulator_.estimate_n_m()[j];
      if (log_.torque_columns) row.push_back(options_.noise ? Rounded(estimate + noise, kArmTorqueQuantum) : estimate);
    }
    if (missed) return;
    Snapshot(t, last);
    record_.rows.push_back(std::move(row));
    record_.time_s.push_back(t);
    record_.jitter.push_back(jitter);
    record_.target_rad.push_back(target);
    record_.angle_rad.push_back(shown);
    record_.q_rad.push_back(simulator_.q());
    record_.w_rad_per_s.push_back(simulator_.w());
    record_.torque_n_m.push_back(simulator_.torque_n_m());
  }

  void Snapshot(double time_s, bool last) {
    if (options_.snapshot_every_s <= 0 || last || time_s + 1e-9 < next_snapshot_s_) return;
    record_.snapshots.push_back(simulator_);
    record_.snapshot_rows.push_back(record_.time_s.size());
    next_snapshot_s_ += options_.snapshot_every_s;
  }

  const ArmPlant& plant_;
  const ArmLog& log_;
  const ArmSensors& sensors_;
  const RecordOptions& options_;
  double period_s_;
  int substeps_;
  Random noise_, draws_;
  ArmSimulator simulator_;
  ArmCommands commands_;
  std::vector<Encoder> encoders_;
  JointHistory history_, torque_history_;
  bool late_ = false;
  double log_late_s_ = 0;  // all sensors are late alike: the log is, torques too
  double next_snapshot_s_ = 0;
  ArmRecord record_;
};

}  // namespace

ArmRecord MakeArmRecord(const ArmPlant& plant, const ArmLog& log, const ArmSensors& sensors,
                        const RecordOptions& options) {
  return ArmRecorder(plant, log, sensors, options).Make();
}

ArmSensors DrawArmSensors(ArmRig rig, Random* random) {
  ArmSensors sensors;
  for (std::size_t j = 0; j < ArmLinks(rig).size(); ++j) {
    sensors.angle.push_back(DrawSensor(random));
    sensors.angle.back().resolution_rad = kTurn / std::exp2(random->Integer(13, 16));
  }
  sensors.torque_noise = random->LogUniform(0.003, 0.02);
  return sensors;
}

ArmPlant DrawArm(ArmRig rig, Random* random) {
  ArmPlant plant = NominalArm(rig);
  for (const ArmParameter& p : ArmParameters(rig)) {
    plant.joints[p.joint].base.*p.field *= 1 + p.relative_spread * random->Uniform(-1, 1);
  }
  return plant;
}

std::vector<ArmLog> DrawArmLogs(const ArmPlant& plant, Random* random) {
  std::vector<ArmLog> logs;
  const bool torques = random->Chance(0.3);
  double begin = 0;
  for (int i = 0; i < kLogs; ++i) {
    logs.push_back(DrawArmLog(plant, i < 3 ? i : random->Integer(0, 2), random));
    logs.back().torque_columns = torques;
    logs.back().session_s = begin;
    begin += logs.back().duration_s + kPause_s;
  }
  return logs;
}

bool Calm(const ArmPlant& plant, const ArmLog& log) {
  const ArmPeaks peaks = PeaksOfArm(plant, log);
  return peaks.speed <= kTolerableSpeed && peaks.torque <= kTolerableTorque && peaks.turn_rad <= kTolerableTurn_rad;
}

bool TameArm(const ArmPlant& plant, std::vector<ArmLog>* logs) {
  return std::all_of(logs->begin(), logs->end(), [&](ArmLog& log) {
    for (int i = 0; i < 8; ++i) {
      if (Calm(plant, log)) return true;
      log.scale *= 0.75;
    }
    return false;
  });
}

std::vector<Motion> ArmMotions(const ArmPlant& plant, const std::vector<ArmLog>& logs) {
  std::vector<Motion> motions(plant.joints.size());
  const auto grow = [](double* peak, double value) { *peak = std::max(*peak, std::abs(value)); };
  double count = 0;
  for (const ArmLog& log : logs) {
    const ArmRecord record = MakeArmRecord(plant, log, ArmSensors{}, ArmSizing());
    count += static_cast<double>(record.time_s.size());
    for (std::size_t i = 0; i < record.time_s.size(); ++i) {
      for (int j = 0; j < plant.count(); ++j) {
        Motion& m = motions[j];
        const double torque = record.torque_n_m[i][j], w = record.w_rad_per_s[i][j];
        grow(&m.torque_peak_n_m, torque);
        grow(&m.speed1_peak_rad_per_s, w);
        grow(&m.angle1_peak_rad, record.q_rad[i][j]);
        m.torque_rms_n_m += torque * torque;
        m.speed1_rms_rad_per_s += w * w;
      }
    }
  }
  for (Motion& m : motions) {
    m.command_peak = m.torque_peak_n_m;
    m.torque_rms_n_m = std::sqrt(m.torque_rms_n_m / count);
    m.speed1_rms_rad_per_s = std::sqrt(m.speed1_rms_rad_per_s / count);
  }
  return motions;
}

std::vector<JointMotion> ArmJointMotions(const ArmPlant& plant, const std::vector<ArmLog>& logs) {
  std::vector<JointMotion> motions(plant.joints.size());
  for (const ArmLog& log : logs) {
    const ArmRecord record = MakeArmRecord(plant, log, ArmSensors{}, ArmSizing());
    for (JointMotion& m : motions) m.begins.push_back(m.angle_rad.size());
    double next = 0;
    for (std::size_t i = 0; i < record.time_s.size(); ++i) {
      if (record.time_s[i] + 1e-9 < next) continue;
      next = record.time_s[i] + kMotionSample_s;
      for (int j = 0; j < plant.count(); ++j) {
        motions[j].session_s.push_back(log.session_s + record.time_s[i]);
        motions[j].angle_rad.push_back(record.q_rad[i][j]);
        motions[j].speed_rad_per_s.push_back(record.w_rad_per_s[i][j]);
        motions[j].drive_n_m.push_back(record.torque_n_m[i][j]);
      }
    }
  }
  return motions;
}

}  // namespace gapscope::twin
