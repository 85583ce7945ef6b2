// Drives, effects and logs of a twin arm.
#include "tests/twin/arm/recorder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/twin/arm/effects.h"
#include "tests/twin/output.h"

namespace gapscope::twin {
namespace {

constexpr double kCoarse_s = 1e-3, kFine_s = 1e-4;
constexpr double kStepError_rad = 2e-5;  // far below any sensor's floor

std::vector<ArmLog> ShortLogs(const ArmPlant& plant, double duration_s) {
  Random random(11, 0, "logs");
  std::vector<ArmLog> logs = DrawArmLogs(plant, &random);
  for (ArmLog& log : logs) {
    log.duration_s = duration_s;
    log.dropped_share = 0;
  }
  return logs;
}

ArmRecord Exact(const ArmPlant& plant, const ArmLog& log, double step_s = kCoarse_s) {
  RecordOptions options;
  options.step_s = step_s;
  options.noise = false;
  return MakeArmRecord(plant, log, ArmSensors{}, options);
}

double LargestChange(const ArmRecord& a, const ArmRecord& b, std::size_t later = 0) {
  double largest = 0;
  for (std::size_t k = 0; k + later < a.angle_rad.size(); ++k) {
    largest = std::max(largest, (a.angle_rad[k] - b.angle_rad[k + later]).cwiseAbs().maxCoeff());
  }
  return largest;
}

TEST(ArmRecorderTest, RestsWhereTheServosHoldTheWeight) {
  const ArmPlant plant = NominalArm(ArmRig::kArm6);
  const ArmRecord record = Exact(plant, ShortLogs(plant, 0.1)[0]);
  const JointVector none = JointVector::Zero(6);
  const JointVector weight = InverseDynamics(MechanismOf(plant), record.q_rad[0], none, none);
  EXPECT_GT(weight[1], 5);
  for (int j = 0; j < 6; ++j) {
    const double droop = record.target_rad[0][j] - record.q_rad[0][j];
    EXPECT_NEAR(plant.joints[j].base.kp_n_m_per_rad * droop, weight[j], 0.05) << j;
  }
}

TEST(ArmRecorderTest, LateTargetsAndLateSensorsShiftTheLog) {
  ArmPlant plant = NominalArm(ArmRig::kArm2), late = plant, seen_late = plant;
  for (ArmJoint& joint : late.joints) joint.drive.command_delay_s = 0.02;
  for (ArmJoint& joint : seen_late.joints) joint.sensor_delay_s = 0.02;
  ArmLog log = ShortLogs(plant, 2)[0];
  log.torque_columns = true;
  const ArmRecord on_time = Exact(plant, log), later = Exact(seen_late, log);
  EXPECT_GT(LargestChange(on_time, Exact(late, log)), 1e-3);
  EXPECT_LT(LargestChange(on_time, Exact(late, log), 4), 1e-4);  // of rest, which is never quite reached
  EXPECT_LT(LargestChange(on_time, later, 4), 1e-12);
  const std::size_t torque = on_time.names.size() - 1;  // a log that is late as a whole
  EXPECT_NEAR(later.rows[104][torque], on_time.rows[100][torque], 1e-9);
  EXPECT_GT(std::abs(later.rows[104][torque] - on_time.rows[104][torque]), 1e-3);
}

TEST(ArmRecorderTest, CoarseStepsFollowFineOnesBesideDryFriction) {
  ArmPlant plant = NominalArm(ArmRig::kArm6);
  for (int j = 0; j < plant.count(); ++j) {
    Dry& dry = plant.joints[j].dry;
    dry.positive_n_m = dry.negative_n_m = 0.02 * ArmLinks(plant.rig)[j].rated_n_m;
    dry.law = j % 2 == 0 ? FrictionLaw::kMaxwellSlip : FrictionLaw::kLuGre;
  }
  const ArmLog log = ShortLogs(plant, 3)[0];
  EXPECT_LT(LargestChange(Exact(plant, log, kCoarse_s), Exact(plant, log, kFine_s)), kStepError_rad);
}

TEST(ArmRecorderTest, EveryEffectChangesTheMotionUnderItsOwnName) {
  for (const ArmRig rig : {ArmRig::kArm2, ArmRig::kArm6}) {
    const ArmPlant base = NominalArm(rig);
    std::vector<ArmLog> logs = ShortLogs(base, 2);
    logs.resize(1);
    const std::vector<Motion> motions = ArmMotions(base, logs);
    const ArmRecord before = Exact(base, logs[0]);
    std::set<std::string> names;
    for (ArmRange range : ArmEffectsOf(rig)) {
      range.choice.severity = 2;
      range.choice.shape_seed = 3;
      ArmPlant plant = base;
      const Values values = AddArmEffect(range.choice, motions, &plant, nullptr);
      const std::string name = range.choice.name + "@" + ArmPlaceName(rig, range.choice);
      EXPECT_FALSE(values.empty()) << name;
      EXPECT_GT(LargestChange(before, Exact(plant, logs[0])), 1e-5) << name;
      EXPECT_TRUE(names.insert(name).second) << name;
    }
    EXPECT_TRUE(names.count("command_delay@all") && names.count("mount_tilt@model")) << ArmRigName(rig);
    EXPECT_TRUE(names.count("payload@" + ArmLinks(rig).back().body)) << ArmRigName(rig);
  }
}

TEST(ArmRecorderTest, ASharedDelayIsOneSize) {
  ArmPlant plant = NominalArm(ArmRig::kArm6);
  const ArmChoice choice{"command_delay", ArmPlace::kDrive, kAllJoints, 4, 9};
  const Values values = AddArmEffect(choice, std::vector<Motion>(6), &plant, nullptr);
  for (const ArmJoint& joint : plant.joints) EXPECT_EQ(joint.drive.command_delay_s, values[0].second);
}

}  // namespace
}  // namespace gapscope::twin
