// What a twin arm is made of: a chain of revolute joints under position servos, the base parameters of its links and
// drives, and every effect with its neutral value. One joint's drive, dry friction, pull and roughness are those of the
// other twins (plant.h). Values only; its motion is simulator.h.
#ifndef GAPSCOPE_TESTS_TWIN_ARM_ARM_H_
#define GAPSCOPE_TESTS_TWIN_ARM_ARM_H_

#include <Eigen/Dense>
#include <string>
#include <string_view>
#include <vector>

#include "tests/twin/plant.h"

namespace gapscope::twin {

enum class ArmRig { kArm2, kArm6 };
inline constexpr int kMostJoints = 6;

// One number a joint.
using JointVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostJoints, 1>;

// Base parameters of one joint, its position servo and the link that it turns.
struct ArmBase {
  double kp_n_m_per_rad = 0, kd_n_m_s_per_rad = 0;  // torque = kp (target - q) - kd w
  double damping_n_m_s_per_rad = 0, armature_kg_m2 = 0;
  double mass_kg = 0;
};

// What is exact of a joint and its link. Frames: the joint's, at zero parallel to its parent's; q turns it about
// `axis`.
struct ArmLink {
  std::string joint, body;
  Eigen::Vector3d origin_m, axis;  // in the parent's frame; of unit length
  Eigen::Vector3d centre_m;        // centre of mass
  Eigen::Vector3d gyration_m2;     // principal inertia about the centre over the mass, along the frame's axes
  double home_rad;                 // where logs are made about
  double reach_rad;                // how far from there
  double rated_n_m;                // what the drive can hold; twice as much for a moment
  std::string Actuator() const { return joint + "_servo"; }
  std::string Signal() const { return joint + "_rad"; }
};
const std::vector<ArmLink>& ArmLinks(ArmRig rig);
const char* ArmRigName(ArmRig rig);
// False when no arm is called so.
bool ParseArmRig(std::string_view name, ArmRig* rig);

// One base parameter by the name of the rig's experiment file.
struct ArmParameter {
  std::string name, unit;
  int joint;
  double ArmBase::* field;
  double relative_spread;  // 0: exact
};
const std::vector<ArmParameter>& ArmParameters(ArmRig rig);

struct ArmJoint {
  ArmBase base;
  Drive drive;
  Dry dry;
  Load load;
  Rough rough;
  double sensor_delay_s = 0;
};

struct ArmPlant {
  ArmRig rig = ArmRig::kArm2;
  std::vector<ArmJoint> joints;
  double payload_kg = 0;                                // a point on the last body
  Eigen::Vector3d payload_m = Eigen::Vector3d::Zero();  // in that body's frame
  double tilt_x_rad = 0, tilt_y_rad = 0;                // the base turned by x about its x axis, then y about its y
  double gravity_m_per_s2 = 9.81;
  int count() const { return static_cast<int>(joints.size()); }
};
ArmPlant NominalArm(ArmRig rig);

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_ARM_ARM_H_
