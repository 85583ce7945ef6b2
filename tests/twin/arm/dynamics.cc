#include "tests/twin/arm/dynamics.h"

#include <array>

namespace gapscope::twin {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

template <class T>
using PerJoint = std::array<T, kMostJoints>;

// From each body's frame to its parent's.
using Turns = PerJoint<Matrix3d>;

Turns TurnsAt(const Mechanism& m, const JointVector& q) {
  Turns turns;
  for (int j = 0; j < m.count(); ++j) turns[j] = Eigen::AngleAxisd(q[j], m.bodies[j].axis).toRotationMatrix();
  return turns;
}

// Of a body's frame, in its own directions.
struct Motion3 {
  Vector3d turning, turning_rate, rate;  // angular speed and acceleration, acceleration of the origin
};

Motion3 Outward(const RigidBody& b, const Matrix3d& turn, const Motion3& parent, double w, double a) {
  const Vector3d at =
      parent.rate + parent.turning_rate.cross(b.origin_m) + parent.turning.cross(parent.turning.cross(b.origin_m));
  const Vector3d carried = turn.transpose() * parent.turning;
  return {carried + b.axis * w, turn.transpose() * parent.turning_rate + b.axis * a + carried.cross(b.axis * w),
          turn.transpose() * at};
}

JointVector InverseAt(const Mechanism& m, const Turns& turns, const JointVector& w, const JointVector& a) {
  const int n = m.count();
  PerJoint<Vector3d> force, moment;  // of a body and all that it carries, about its joint
  Motion3 motion = {Vector3d::Zero(), Vector3d::Zero(), -m.gravity_m_per_s2};
  for (int j = 0; j < n; ++j) {
    const RigidBody& b = m.bodies[j];
    motion = Outward(b, turns[j], motion, w[j], a[j]);
    const Vector3d centre_rate =
        motion.rate + motion.turning_rate.cross(b.centre_m) + motion.turning.cross(motion.turning.cross(b.centre_m));
    force[j] = b.mass_kg * centre_rate;
    moment[j] = b.inertia_kg_m2 * motion.turning_rate + motion.turning.cross(b.inertia_kg_m2 * motion.turning) +
                b.centre_m.cross(force[j]);
  }
  JointVector torque(n);
  for (int j = n - 1; j >= 0; --j) {
    const RigidBody& b = m.bodies[j];
    torque[j] = b.axis.dot(moment[j]) + b.armature_kg_m2 * a[j];
    if (j == 0) break;
    const Vector3d carried = turns[j] * force[j];
    force[j - 1] += carried;
    moment[j - 1] += turns[j] * moment[j] + b.origin_m.cross(carried);
  }
  return torque;
}

// A body and all that it carries, stiff: mass, first moment and inertia about its joint.
struct Composite {
  double mass = 0;
  Vector3d moment = Vector3d::Zero();
  Matrix3d inertia = Matrix3d::Zero();
};

// Inertia of a mass about a point away from its centre by `d`.
Matrix3d Steiner(double mass, const Vector3d& d) {
  return mass * (d.squaredNorm() * Matrix3d::Identity() - d * d.transpose());
}

JointMatrix MatrixAt(const Mechanism& m, const Turns& turns) {
  const int n = m.count();
  PerJoint<Composite> composite;
  for (int j = 0; j < n; ++j) {
    const RigidBody& b = m.bodies[j];
    composite[j] = {b.mass_kg, b.mass_kg * b.centre_m, b.inertia_kg_m2 + Steiner(b.mass_kg, b.centre_m)};
  }
  JointMatrix matrix(n, n);
  for (int j = n - 1; j >= 0; --j) {
    const RigidBody& b = m.bodies[j];
    const Composite& c = composite[j];
    Vector3d force = b.axis.cross(c.moment), moment = c.inertia * b.axis;
    matrix(j, j) = b.axis.dot(moment) + b.armature_kg_m2;
    for (int i = j; i > 0; --i) {
      force = turns[i] * force;
      moment = turns[i] * moment + m.bodies[i].origin_m.cross(force);
      matrix(i - 1, j) = matrix(j, i - 1) = m.bodies[i - 1].axis.dot(moment);
    }
    if (j == 0) break;
    // To the parent's joint, by way of the composite's centre of mass.
    const Vector3d centre = c.moment / c.mass;
    const Matrix3d about_centre = c.inertia - Steiner(c.mass, centre);
    const Vector3d there = turns[j] * centre + b.origin_m;
    Composite& parent = composite[j - 1];
    parent.mass += c.mass;
    parent.moment += c.mass * there;
    parent.inertia += turns[j] * about_centre * turns[j].transpose() + Steiner(c.mass, there);
  }
  return matrix;
}

}  // namespace

Mechanism MechanismOf(const ArmPlant& plant) {
  Mechanism m;
  const auto& links = ArmLinks(plant.rig);
  for (std::size_t j = 0; j < links.size(); ++j) {
    const ArmBase& base = plant.joints[j].base;
    const Matrix3d inertia = (base.mass_kg * links[j].gyration_m2).asDiagonal();
    m.bodies.push_back(
        {links[j].origin_m, links[j].axis, links[j].centre_m, inertia, base.mass_kg, base.armature_kg_m2});
  }
  if (plant.payload_kg > 0) {
    RigidBody& b = m.bodies.back();
    const double mass = b.mass_kg + plant.payload_kg;
    const Vector3d centre = (b.mass_kg * b.centre_m + plant.payload_kg * plant.payload_m) / mass;
    b.inertia_kg_m2 += Steiner(b.mass_kg, b.centre_m - centre) + Steiner(plant.payload_kg, plant.payload_m - centre);
    b.mass_kg = mass;
    b.centre_m = centre;
  }
  const Matrix3d base =
      (Eigen::AngleAxisd(plant.tilt_x_rad, Vector3d::UnitX()) * Eigen::AngleAxisd(plant.tilt_y_rad, Vector3d::UnitY()))
          .toRotationMatrix();
  m.gravity_m_per_s2 = base.transpose() * Vector3d(0, 0, -plant.gravity_m_per_s2);
  return m;
}

JointVector InverseDynamics(const Mechanism& m, const JointVector& q, const JointVector& w, const JointVector& a) {
  return InverseAt(m, TurnsAt(m, q), w, a);
}

JointMatrix MassMatrix(const Mechanism& m, const JointVector& q) { return MatrixAt(m, TurnsAt(m, q)); }

JointVector ForwardDynamics(const Mechanism& m, const JointVector& q, const JointVector& w, const JointVector& torque) {
  const Turns turns = TurnsAt(m, q);
  const JointVector free = torque - InverseAt(m, turns, w, JointVector::Zero(m.count()));
  return MatrixAt(m, turns).llt().solve(free);
}

double Energy(const Mechanism& m, const JointVector& q, const JointVector& w) {
  const Turns turns = TurnsAt(m, q);
  Matrix3d to_base = Matrix3d::Identity();
  Vector3d origin = Vector3d::Zero(), speed = Vector3d::Zero(),
           turning = Vector3d::Zero();  // the parent's, in the base
  double energy = 0;
  for (int j = 0; j < m.count(); ++j) {
    const RigidBody& b = m.bodies[j];
    const Vector3d arm = to_base * b.origin_m;
    speed += turning.cross(arm);
    origin += arm;
    to_base *= turns[j];
    turning += to_base * b.axis * w[j];
    const Vector3d centre = to_base * b.centre_m;
    const Vector3d own = to_base.transpose() * turning;
    energy += b.mass_kg * (speed + turning.cross(centre)).squaredNorm() / 2 + own.dot(b.inertia_kg_m2 * own) / 2;
    energy += b.armature_kg_m2 * w[j] * w[j] / 2 - b.mass_kg * m.gravity_m_per_s2.dot(origin + centre);
  }
  return energy;
}

}  // namespace gapscope::twin
