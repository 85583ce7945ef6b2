// The double pendulum: MuJoCo against the two-link equations with rotors behind gears
// (models/double_pendulum/README.md).
#include <gtest/gtest.h>

#include "tests/models/rig.h"

namespace gapscope::testing {
namespace {

// The source's model_1.0. Inertias I are about the joints' axes.
struct TwoLinks {
  double m1 = 0.52346, r1 = 0.2, l1 = 0.2, m2 = 0.62557, r2 = 0.25569, rotor = 6.287e-5, damping = 0.001, g = 9.81;
  double i1 = 0.010949 + m1 * r1 * r1, i2 = 0.009971 + m2 * r2 * r2;

  std::array<double, 4> operator()(const std::array<double, 4>& x, const std::vector<double>& u) const {
    const auto [q1, q2, v1, v2] = x;
    const double a2 = m2 * l1 * r2, s = a2 * std::sin(q2), c = a2 * std::cos(q2), g2 = g * m2 * r2 * std::sin(q1 + q2);
    const double m11 = i1 + i2 + m2 * l1 * l1 + 37 * rotor + 2 * c, m12 = i2 - 6 * rotor + c, m22 = i2 + 36 * rotor;
    const double right1 =
        u[0] - damping * v1 + s * (2 * v1 * v2 + v2 * v2) - g * (m1 * r1 + m2 * l1) * std::sin(q1) - g2;
    const double right2 = u[1] - damping * v2 - s * v1 * v1 - g2;
    const double det = m11 * m22 - m12 * m12;
    return {v1, v2, (m22 * right1 - m12 * right2) / det, (m11 * right2 - m12 * right1) / det};
  }
};

TEST(DoublePendulumModelTest, FollowsTheEquationsSwingingWidely) {
  const ModelPtr m = LoadRig("double_pendulum");
  ASSERT_NE(m, nullptr);
  const double h = m->opt.timestep;
  const auto command = [&](int k) {
    return std::vector<double>{ChirpAndSteps(k * h, 1.5, 0.3, 3, 2), ChirpAndSteps(k * h, -0.6, 0.5, 5, 2)};
  };
  const std::vector<double> start = {0.2, -0.4};
  const Motion motion = Drive(*m, start, static_cast<int>(std::lround(2 / h)), command);
  EXPECT_LT(LargestDifference<4>(*m, motion, start, 2e-5, TwoLinks{}, command), 2e-5);
  double shoulder = 0, elbow = 0;
  for (const auto& q : motion.q)
    shoulder = std::fmax(shoulder, std::abs(q[0])), elbow = std::fmax(elbow, std::abs(q[1]));
  EXPECT_GT(shoulder, 0.8);
  EXPECT_GT(elbow, 0.8);
}

}  // namespace
}  // namespace gapscope::testing
