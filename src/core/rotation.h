// Orientations as unit quaternions (w, x, y, z; MuJoCo's order) and as rotation vectors: the axis times the angle, rad.
#ifndef GAPSCOPE_CORE_ROTATION_H_
#define GAPSCOPE_CORE_ROTATION_H_

#include <array>

namespace gapscope {

using Vector3 = std::array<double, 3>;
using Quaternion = std::array<double, 4>;
inline constexpr Quaternion kNoRotation = {1, 0, 0, 0};

// The quaternion of a rotation vector.
Quaternion ExpRotation(const Vector3& rotation);
// The shortest rotation vector of a quaternion of any length but zero: q and -q are the same rotation.
Vector3 LogRotation(const Quaternion& q);
Quaternion operator*(const Quaternion& a, const Quaternion& b);
Quaternion Conjugate(const Quaternion& q);
Quaternion Normalised(const Quaternion& q);
// A vector turned by a unit quaternion.
Vector3 Rotate(const Quaternion& q, const Vector3& v);
Vector3 Cross(const Vector3& a, const Vector3& b);
// Of the rotation vectors that are the same rotation as `rotation`, whole turns apart along its axis, the one nearest
// to `near`: a body that turns on leaves no jump at half a turn.
Vector3 NearestTurn(const Vector3& rotation, const Vector3& near);

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_ROTATION_H_
