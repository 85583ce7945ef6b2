// Logs of a twin arm: targets of all joints about a home pose, angles through encoders with offset, coloured noise and
// quantisation. The arm has come to rest on its first targets when a log begins. Row k holds the angles at time k and
// the targets sent at time k.
#ifndef GAPSCOPE_TESTS_TWIN_ARM_RECORDER_H_
#define GAPSCOPE_TESTS_TWIN_ARM_RECORDER_H_

#include <string>
#include <vector>

#include "tests/twin/arm/arm.h"
#include "tests/twin/arm/simulator.h"
#include "tests/twin/effects.h"
#include "tests/twin/excitation.h"
#include "tests/twin/random.h"
#include "tests/twin/recorder.h"
#include "tests/twin/rough.h"

namespace gapscope::twin {

struct ArmSensors {
  std::vector<Sensor> angle;
  double torque_noise = 0.01;  // white, of each drive's rated torque
};

struct ArmLog {
  std::vector<Excitation> excitation;  // of each joint
  JointVector home_rad, amplitude_rad;
  double scale = 1;  // of all amplitudes
  double duration_s = 15, rate_hz = 200;
  double session_s = 0;  // when the log began
  double dropped_share = 0;
  std::uint64_t seed = 0;
  bool torque_columns = false;
  double TargetOf(int joint, double time_s) const {
    return home_rad[joint] + scale * amplitude_rad[joint] * excitation[static_cast<std::size_t>(joint)].At(time_s);
  }
};

struct ArmRecord {
  std::vector<std::string> names;
  std::vector<std::vector<double>> rows;  // as logged
  // Of each logged row: stamp, what was sent, the standard normal jitter of its delay; the angles with sensor effects,
  // without noise and offset; the arm's own motion and its drives' torques.
  std::vector<double> time_s, jitter;
  std::vector<JointVector> target_rad, angle_rad, q_rad, w_rad_per_s, torque_n_m;
  std::vector<ArmSimulator> snapshots;  // at the beginning of every window, when asked for
  std::vector<std::size_t> snapshot_rows;
};

// Angles or torques of the past at every substep, for late sensors.
class JointHistory {
 public:
  void Push(const JointVector& values) { past_.push_back(values); }
  // `step`: substeps since the first push, fractions included; held at both ends.
  double At(int joint, double step) const;

 private:
  std::vector<JointVector> past_;
};

ArmRecord MakeArmRecord(const ArmPlant& plant, const ArmLog& log, const ArmSensors& sensors,
                        const RecordOptions& options);
// The record's targets as `plant` receives them.
ArmCommands ReceivedByArm(const ArmRecord& record, const ArmPlant& plant);

ArmSensors DrawArmSensors(ArmRig rig, Random* random);
ArmPlant DrawArm(ArmRig rig, Random* random);
// A fast log, a slow one, one of jumps, and one of any kind, each joint with an excitation of its own; scaled so that
// `plant` stays below drawn speeds and torques.
std::vector<ArmLog> DrawArmLogs(const ArmPlant& plant, Random* random);
// Whether a careful experimenter would have kept the log; amplitudes down until it is so, false when nothing helps.
bool Calm(const ArmPlant& plant, const ArmLog& log);
bool TameArm(const ArmPlant& plant, std::vector<ArmLog>* logs);

// Of each joint, as of the first joint of the other rigs: what severities and roughness are relative to.
std::vector<Motion> ArmMotions(const ArmPlant& plant, const std::vector<ArmLog>& logs);
std::vector<JointMotion> ArmJointMotions(const ArmPlant& plant, const std::vector<ArmLog>& logs);

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_ARM_RECORDER_H_
