// The arm's dynamics against closed forms, and against what any mechanism obeys.
#include "tests/twin/arm/dynamics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/twin/arm/simulator.h"
#include "tests/twin/random.h"

namespace gapscope::twin {
namespace {

constexpr double kRounding = 1e-9;

JointVector Draw(int count, double size, Random* random) {
  JointVector v(count);
  for (int j = 0; j < count; ++j) v[j] = size * random->Uniform(-1, 1);
  return v;
}

JointVector Pair(double first, double second) {
  JointVector v(2);
  v << first, second;
  return v;
}

// Two links in a vertical plane, hanging at zero, the second angle relative to the first.
JointVector TwoLinks(const ArmPlant& plant, const JointVector& q, const JointVector& w, const JointVector& a) {
  const auto& links = ArmLinks(ArmRig::kArm2);
  const ArmBase &first = plant.joints[0].base, &second = plant.joints[1].base;
  const double m1 = first.mass_kg, m2 = second.mass_kg, g = plant.gravity_m_per_s2;
  const double r1 = -links[0].centre_m.z(), r2 = -links[1].centre_m.z(), l1 = -links[1].origin_m.z();
  const double i1 = m1 * links[0].gyration_m2.y(), i2 = m2 * links[1].gyration_m2.y();
  const double c = m2 * l1 * r2 * std::cos(q[1]), s = m2 * l1 * r2 * std::sin(q[1]);
  const double m22 = i2 + m2 * r2 * r2, m12 = m22 + c;
  const double m11 = i1 + m1 * r1 * r1 + m2 * l1 * l1 + m22 + 2 * c;
  const double second_weight = m2 * g * r2 * std::sin(q[0] + q[1]);
  const double first_weight = g * (m1 * r1 + m2 * l1) * std::sin(q[0]) + second_weight;
  return Pair((m11 + first.armature_kg_m2) * a[0] + m12 * a[1] - s * (2 * w[0] * w[1] + w[1] * w[1]) + first_weight,
              m12 * a[0] + (m22 + second.armature_kg_m2) * a[1] + s * w[0] * w[0] + second_weight);
}

TEST(ArmDynamicsTest, InverseDynamicsIsTheTwoLinkEquations) {
  const ArmPlant plant = NominalArm(ArmRig::kArm2);
  const Mechanism m = MechanismOf(plant);
  Random random(1, 0, "poses");
  for (int i = 0; i < 50; ++i) {
    const JointVector q = Draw(2, 3, &random), w = Draw(2, 5, &random), a = Draw(2, 20, &random);
    const JointVector off = InverseDynamics(m, q, w, a) - TwoLinks(plant, q, w, a);
    EXPECT_LT(off.cwiseAbs().maxCoeff(), kRounding);
  }
}

class ArmMechanismTest : public ::testing::TestWithParam<ArmRig> {};

TEST_P(ArmMechanismTest, MassMatrixHoldsUnitAccelerationsAndIsPositive) {
  Random random(2, 0, "poses");
  Mechanism m = MechanismOf(NominalArm(GetParam()));
  m.gravity_m_per_s2.setZero();
  const int n = m.count();
  const JointVector none = JointVector::Zero(n);
  for (int i = 0; i < 20; ++i) {
    const JointVector q = Draw(n, 3, &random);
    const JointMatrix matrix = MassMatrix(m, q);
    EXPECT_LT((matrix - matrix.transpose()).cwiseAbs().maxCoeff(), kRounding);
    for (int j = 0; j < n; ++j) {
      const JointVector column = InverseDynamics(m, q, none, JointVector::Unit(n, j));
      EXPECT_LT((column - matrix.col(j)).cwiseAbs().maxCoeff(), kRounding);
    }
    EXPECT_EQ(matrix.llt().info(), Eigen::Success);
  }
}

TEST_P(ArmMechanismTest, ForwardDynamicsUndoesInverse) {
  Random random(3, 0, "poses");
  const Mechanism m = MechanismOf(NominalArm(GetParam()));
  const int n = m.count();
  for (int i = 0; i < 20; ++i) {
    const JointVector q = Draw(n, 3, &random), w = Draw(n, 4, &random), a = Draw(n, 20, &random);
    const JointVector again = ForwardDynamics(m, q, w, InverseDynamics(m, q, w, a));
    EXPECT_LT((again - a).cwiseAbs().maxCoeff(), kRounding);
  }
}

TEST_P(ArmMechanismTest, PayloadIsAHeavierLastLink) {
  Random random(4, 0, "poses");
  ArmPlant plant = NominalArm(GetParam());
  Mechanism heavier = MechanismOf(plant);
  plant.payload_kg = 0.7;
  plant.payload_m = ArmLinks(GetParam()).back().centre_m;
  heavier.bodies.back().mass_kg += 0.7;  // at the centre of mass: nothing about it turns harder
  const int n = plant.count();
  const JointVector q = Draw(n, 3, &random), w = Draw(n, 4, &random), a = Draw(n, 20, &random);
  const JointVector off = InverseDynamics(MechanismOf(plant), q, w, a) - InverseDynamics(heavier, q, w, a);
  EXPECT_LT(off.cwiseAbs().maxCoeff(), kRounding);
}

// A payload away from the centre, against the energy of a point: half m v^2 + m g h.
TEST(ArmDynamicsTest, PayloadIsAPoint) {
  ArmPlant plant = NominalArm(ArmRig::kArm2);
  const JointVector q = Pair(0.7, -0.4), w = Pair(1.3, 2.1);
  const double before = Energy(MechanismOf(plant), q, w);
  plant.payload_kg = 0.5;
  plant.payload_m = {0.03, 0.02, -0.2};
  const double l1 = 0.34, down = 0.2, out = 0.03;
  const double z = -l1 * std::cos(q[0]) - down * std::cos(q[0] + q[1]) + out * std::sin(q[0] + q[1]);
  const double turn = w[0] + w[1];
  const double vx = l1 * std::cos(q[0]) * w[0] + (down * std::cos(q[0] + q[1]) - out * std::sin(q[0] + q[1])) * turn;
  const double vz = l1 * std::sin(q[0]) * w[0] + (down * std::sin(q[0] + q[1]) + out * std::cos(q[0] + q[1])) * turn;
  const double expected = 0.5 * ((vx * vx + vz * vz) / 2 + plant.gravity_m_per_s2 * z);
  EXPECT_NEAR(Energy(MechanismOf(plant), q, w) - before, expected, kRounding);
}

// A base turned about the plane's own axis is an arm that hangs elsewhere.
TEST(ArmDynamicsTest, TiltedMountIsTurnedGravity) {
  const double tilt = 0.2;
  ArmPlant plant = NominalArm(ArmRig::kArm2);
  const JointVector q = Pair(0.7, -0.4), none = Pair(0, 0);
  const JointVector turned = InverseDynamics(MechanismOf(plant), Pair(q[0] - tilt, q[1]), none, none);
  plant.tilt_y_rad = tilt;  // the joints' axes point along -y
  EXPECT_LT((InverseDynamics(MechanismOf(plant), q, none, none) - turned).cwiseAbs().maxCoeff(), kRounding);
  // By x, then by y: what a level on the turned base shows.
  plant.tilt_x_rad = 0.3;
  const Eigen::Vector3d seen = MechanismOf(plant).gravity_m_per_s2 / plant.gravity_m_per_s2;
  const Eigen::Vector3d level(std::cos(0.3) * std::sin(tilt), -std::sin(0.3), -std::cos(0.3) * std::cos(tilt));
  EXPECT_LT((seen - level).cwiseAbs().maxCoeff(), kRounding);
}

TEST_P(ArmMechanismTest, ConservesEnergyWithoutDriveAndDamping) {
  ArmPlant plant = NominalArm(GetParam());
  for (ArmJoint& joint : plant.joints) {
    joint.base.kp_n_m_per_rad = joint.base.kd_n_m_s_per_rad = joint.base.damping_n_m_s_per_rad = 0;
  }
  Random random(5, 0, "start");
  ArmSimulator simulator(plant, 1e-4);
  simulator.Place(Draw(plant.count(), 1, &random), Draw(plant.count(), 3, &random));
  ArmCommands commands(plant.joints.size());
  for (Commands& of : commands) of.Add(0, 0.3, 0, 0);
  const double before = simulator.Energy();
  const JointVector start = simulator.q();
  for (int i = 0; i < 10000; ++i) simulator.Step(commands);
  EXPECT_GT((simulator.q() - start).cwiseAbs().maxCoeff(), 0.5);
  EXPECT_NEAR(simulator.Energy(), before, 1e-9 * std::abs(before) + 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Rigs, ArmMechanismTest, ::testing::Values(ArmRig::kArm2, ArmRig::kArm6),
                         [](const auto& test) { return std::string(ArmRigName(test.param)); });

}  // namespace
}  // namespace gapscope::twin
