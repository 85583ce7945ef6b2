// Dynamics of a chain of revolute joints.
//   inverse   recursive Newton-Euler: speeds and accelerations outward, forces inward (Luh, Walker and Paul, "On-line
//             computational scheme for mechanical manipulators", J. Dyn. Sys. Meas. Control 102, 1980)
//   matrix    composite rigid bodies, one unit acceleration each (Walker and Orin 1982, method 3; Featherstone, "Rigid
//             Body Dynamics Algorithms", 2008, section 6.2)
//   forward   M a = torque - what the inverse dynamics asks for without acceleration
// A rotor's armature counts on its own joint and couples no others.
#ifndef GAPSCOPE_TESTS_TWIN_ARM_DYNAMICS_H_
#define GAPSCOPE_TESTS_TWIN_ARM_DYNAMICS_H_

#include <Eigen/Dense>
#include <vector>

#include "tests/twin/arm/arm.h"

namespace gapscope::twin {

struct RigidBody {
  Eigen::Vector3d origin_m, axis;  // of its joint, as in ArmLink
  Eigen::Vector3d centre_m;
  Eigen::Matrix3d inertia_kg_m2;  // about the centre of mass, in its own frame
  double mass_kg, armature_kg_m2;
};

struct Mechanism {
  std::vector<RigidBody> bodies;
  Eigen::Vector3d gravity_m_per_s2;
  int count() const { return static_cast<int>(bodies.size()); }
};
// Payload and tilt included.
Mechanism MechanismOf(const ArmPlant& plant);

using JointMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostJoints, kMostJoints>;

// The torques that make the joints accelerate so.
JointVector InverseDynamics(const Mechanism& m, const JointVector& q, const JointVector& w, const JointVector& a);
JointMatrix MassMatrix(const Mechanism& m, const JointVector& q);
JointVector ForwardDynamics(const Mechanism& m, const JointVector& q, const JointVector& w, const JointVector& torque);
// Kinetic and potential, from the bodies' own speeds and heights.
double Energy(const Mechanism& m, const JointVector& q, const JointVector& w);

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_ARM_DYNAMICS_H_
