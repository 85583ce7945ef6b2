#include "src/core/rotation.h"

#include <cmath>
#include <numbers>

namespace gapscope {
namespace {

double Norm(const Vector3& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

constexpr double kTiny = 1e-8;  // below, the series' next term is rounding

}  // namespace

Quaternion ExpRotation(const Vector3& rotation) {
  const double angle = Norm(rotation);
  const double share = angle > kTiny ? std::sin(angle / 2) / angle : 0.5;
  return {std::cos(angle / 2), share * rotation[0], share * rotation[1], share * rotation[2]};
}

Vector3 LogRotation(const Quaternion& q) {
  const Vector3 axis = {q[1], q[2], q[3]};
  const double sine = Norm(axis), sign = q[0] < 0 ? -1 : 1;
  const double angle = 2 * std::atan2(sine, std::abs(q[0]));
  const double share = sign * (sine > kTiny * std::abs(q[0]) ? angle / sine : 2 / std::abs(q[0]));
  return {share * axis[0], share * axis[1], share * axis[2]};
}

Quaternion operator*(const Quaternion& a, const Quaternion& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

Quaternion Conjugate(const Quaternion& q) { return {q[0], -q[1], -q[2], -q[3]}; }

Quaternion Normalised(const Quaternion& q) {
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return {q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm};
}

Vector3 Cross(const Vector3& a, const Vector3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Vector3 Rotate(const Quaternion& q, const Vector3& v) {
  const Vector3 axis = {q[1], q[2], q[3]}, once = Cross(axis, v), twice = Cross(axis, once);
  return {v[0] + 2 * (q[0] * once[0] + twice[0]), v[1] + 2 * (q[0] * once[1] + twice[1]),
          v[2] + 2 * (q[0] * once[2] + twice[2])};
}

Vector3 NearestTurn(const Vector3& rotation, const Vector3& near) {
  const double angle = Norm(rotation);
  if (angle < kTiny) {
    // No rotation: any whole turns about any axis.
    const double whole = 2 * std::numbers::pi * std::round(Norm(near) / (2 * std::numbers::pi)), length = Norm(near);
    if (whole == 0) return rotation;
    return {whole / length * near[0], whole / length * near[1], whole / length * near[2]};
  }
  const double along = (rotation[0] * near[0] + rotation[1] * near[1] + rotation[2] * near[2]) / angle;
  const double turns = std::round((along - angle) / (2 * std::numbers::pi));
  const double share = 1 + 2 * std::numbers::pi * turns / angle;
  return {share * rotation[0], share * rotation[1], share * rotation[2]};
}

}  // namespace gapscope
