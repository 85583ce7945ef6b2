#include "src/diagnose/torques.h"

#include <algorithm>
#include <numbers>
#include <random>

#include "src/core/statistics.h"
#include "src/diagnose/policy.h"
#include "src/experiment/local_fit.h"

namespace gapscope {
namespace {

// Mean and deviation of a joint's angle and speed in the logs.
struct JointMotion {
  double angle = 0, angle_deviation = 0, speed = 0, speed_deviation = 0;
};

JointMotion MotionOf(const std::vector<Recording>& recordings, const std::string& joint) {
  constexpr std::size_t kSamples = 400;
  std::vector<double> angles, speeds;
  for (const auto& recording : recordings) {
    for (const auto& measured : recording.measured) {
      if (!TraitsOf(measured.spec.kind).gives_angle || measured.spec.on != joint) continue;
      for (std::size_t row = 0; row < recording.rows(); row += std::max<std::size_t>(1, recording.rows() / kSamples)) {
        const auto fit = FitLocally(recording, measured, row, kInitialFitHalfWidth_s);
        if (!std::isfinite(fit.value) || !std::isfinite(fit.slope)) continue;
        angles.push_back(fit.value);
        speeds.push_back(fit.slope);
      }
    }
  }
  const Moments angle = MomentsOf(angles), speed = MomentsOf(speeds);
  return {angle.mean, angle.deviation, speed.mean, speed.deviation};
}

// Deviation of the commands of the drive at a joint; no drive: none of it.
struct DriveMotion {
  int actuator = -1;
  double deviation = 0;
};

DriveMotion DriveOf(const Workbench& bench, int joint) {
  const mjModel& m = bench.rig->compiled();
  const auto& commands = bench.rig->experiment().commands;
  for (std::size_t c = 0; c < commands.size(); ++c) {
    const int actuator = mj_name2id(&m, mjOBJ_ACTUATOR, commands[c].actuator.c_str());
    if (actuator < 0 || m.actuator_trntype[actuator] != mjTRN_JOINT || m.actuator_trnid[2 * actuator] != joint)
      continue;
    double most = 0;
    for (const auto& recording : bench.data->train)
      most = std::max(most, MomentsOf(recording.commands[c].values).deviation);
    if (most > 0) return {actuator, most};
  }
  return {};
}

// `count` a joint, in thirds of angle, of speed and of both. `free_form`: of both alone, and of the command in two of
// three.
std::vector<ProbeTorque> DrawTorques(const Workbench& bench, std::size_t count, bool free_form) {
  const EvidencePolicy& policy = kDiagnosePolicy.evidence;
  std::vector<ProbeTorque> torques;
  std::mt19937_64 random(free_form ? 8 : 7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> phase(0, 2 * std::numbers::pi);
  const mjModel& m = bench.rig->compiled();
  for (int joint = 0; joint < m.njnt; ++joint) {
    const char* name = mj_id2name(&m, mjOBJ_JOINT, joint);
    if (!name || !bench.scales.contains(name)) continue;
    const JointMotion motion = MotionOf(bench.data->train, name);
    if (!(motion.angle_deviation > 0) || !(motion.speed_deviation > 0)) continue;
    const DriveMotion drive = free_form ? DriveOf(bench, joint) : DriveMotion{};
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t third = free_form ? 2 : 3 * i / count;  // of angle, of speed, of both
      const double a = third == 1 ? 0 : policy.angle_waves * normal(random),
                   b = third == 0 ? 0 : policy.speed_waves * normal(random);
      ProbeTorque probe{.joint = joint,
                        .amplitude_n_m = policy.torque_share * bench.scales.at(name).torque_n_m,
                        .per_rad = a / motion.angle_deviation,
                        .s_per_rad = b / motion.speed_deviation,
                        .phase_rad = phase(random)};
      probe.phase_rad -= probe.per_rad * motion.angle + probe.s_per_rad * motion.speed;
      if (drive.actuator >= 0 && i % 3 > 0) {
        probe.actuator = drive.actuator;
        probe.per_command = policy.speed_waves * normal(random) / drive.deviation;
      }
      torques.push_back(probe);
    }
  }
  return torques;
}

}  // namespace

std::vector<ProbeTorque> MakeTorques(const Workbench& bench) {
  return DrawTorques(bench, kDiagnosePolicy.evidence.torques, false);
}

std::vector<ProbeTorque> MakeFreeForm(const Workbench& bench) {
  return DrawTorques(bench, kDiagnosePolicy.evidence.free_form, true);
}

}  // namespace gapscope
