#pragma once

#include "core/geometry/vec.hpp"

namespace hairnet {

// x -> rotation x + position. `rotation` is a unit quaternion; position in metres.
struct RigidTransform {
  Quat rotation = Quat::Identity();
  Vec3 position = Vec3::Zero();

  [[nodiscard]] Vec3 point(const Vec3& x) const { return rotation * x + position; }
  [[nodiscard]] Vec3 vector(const Vec3& v) const { return rotation * v; }
  [[nodiscard]] RigidTransform inverse() const {
    const Quat back = rotation.conjugate();
    return {back, -(back * position)};
  }
  // (a * b)(x) = a(b(x))
  friend RigidTransform operator*(const RigidTransform& a, const RigidTransform& b) {
    // Normalised each time, as products of many rotations would drift from unit length.
    return {(a.rotation * b.rotation).normalized(), a.rotation * b.position + a.position};
  }
};

// Linear in position, shortest-arc slerp in rotation; s in [0, 1], or a little outside to extrapolate.
inline RigidTransform interpolate(const RigidTransform& a, const RigidTransform& b, double s) {
  return {a.rotation.slerp(s, b.rotation).normalized(), a.position + s * (b.position - a.position)};
}

}  // namespace hairnet
