// Rotation vectors and quaternions against Rodrigues' matrix.
#include "src/core/rotation.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

namespace gapscope {
namespace {

constexpr double kRounding = 1e-13;
const double kPi = std::numbers::pi;

// R = 1 + sin(a) K + (1 - cos(a)) K^2 with K the cross product of the axis.
Eigen::Matrix3d Rodrigues(const Vector3& rotation) {
  const Eigen::Vector3d v(rotation[0], rotation[1], rotation[2]);
  const double angle = v.norm();
  if (angle == 0) return Eigen::Matrix3d::Identity();
  const Eigen::Vector3d n = v / angle;
  Eigen::Matrix3d k;
  k << 0, -n[2], n[1], n[2], 0, -n[0], -n[1], n[0], 0;
  return Eigen::Matrix3d::Identity() + std::sin(angle) * k + (1 - std::cos(angle)) * k * k;
}

Eigen::Matrix3d MatrixOf(const Quaternion& q) {
  Eigen::Matrix3d matrix;
  for (int i = 0; i < 3; ++i) {
    Vector3 unit = {};
    unit[static_cast<std::size_t>(i)] = 1;
    const Vector3 turned = Rotate(q, unit);
    matrix.col(i) << turned[0], turned[1], turned[2];
  }
  return matrix;
}

const Vector3 kCases[] = {{0, 0, 0},          {1e-12, 0, -2e-12}, {1e-7, 2e-7, 0},  {0.3, -0.2, 0.5},
                          {0, 0, kPi - 1e-6}, {2, 1, -2},         {-3.1, 0.2, 0.1}, {0, -1.5, 0}};

TEST(RotationTest, ExponentialIsRodrigues) {
  for (const Vector3& v : kCases)
    EXPECT_LT((MatrixOf(ExpRotation(v)) - Rodrigues(v)).cwiseAbs().maxCoeff(), kRounding) << v[0] << " " << v[2];
}

TEST(RotationTest, LogarithmIsTheExponentialsInverseWhateverTheSign) {
  for (const Vector3& v : kCases) {
    const Quaternion q = ExpRotation(v);
    for (const double factor : {1.0, -1.0, 2.5}) {
      const Vector3 back = LogRotation({factor * q[0], factor * q[1], factor * q[2], factor * q[3]});
      for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(back[i], v[i], 1e-9) << factor;
    }
  }
}

TEST(RotationTest, ProductsAreThoseOfTheMatrices) {
  for (const Vector3& a : kCases) {
    for (const Vector3& b : kCases) {
      const Quaternion product = ExpRotation(a) * Conjugate(ExpRotation(b));
      EXPECT_LT((MatrixOf(product) - Rodrigues(a) * Rodrigues(b).transpose()).cwiseAbs().maxCoeff(), kRounding);
    }
  }
}

TEST(RotationTest, TheNearestTurnGoesOnBeyondHalfATurn) {
  Vector3 last = {};
  for (int k = 0; k < 400; ++k) {
    const double angle = 0.05 * k;  // to 20 rad
    const Vector3 turn = {0.6 * angle, 0, -0.8 * angle};
    last = NearestTurn(LogRotation(ExpRotation(turn)), last);
    ASSERT_NEAR(last[0], turn[0], 1e-9) << k;
    ASSERT_NEAR(last[2], turn[2], 1e-9) << k;
  }
}

}  // namespace
}  // namespace gapscope
