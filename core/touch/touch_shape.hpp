#pragma once

#include <string>

#include "core/geometry/rigid_transform.hpp"

namespace hairnet {

// A shape that touches hair. Every one is a box about its origin, in its own axes, whose surface lies `radius_m`
// outside: a sphere has no half size, a capsule one along y alone, a box no radius. A plane is a box so large that the
// hair of a head meets one face of it (half_space).
struct TouchShape {
  Vec3 half_size_m = Vec3::Zero();
  double radius_m = 0;
  // Hair is kept within it, not outside.
  bool is_inside_out = false;
  friend bool operator==(const TouchShape&, const TouchShape&) = default;
};

// The greatest half size and radius that validate() accepts.
inline constexpr double kTouchSizeMax_m = 100;

inline TouchShape sphere(double radius_m) {
  return {.radius_m = radius_m};
}
// The capsule's axis is its own y, and its ends' centres are `half_length_m` from its middle.
inline TouchShape capsule(double half_length_m, double radius_m) {
  return {.half_size_m = {0, half_length_m, 0}, .radius_m = radius_m};
}
inline TouchShape box(const Vec3& half_size_m) {
  return {.half_size_m = half_size_m};
}
// What is below the plane through `place`, whose normal is its own +y, as far as 100 m to its sides and 10 m deep: a
// shape, and where that is to be placed.
struct PlacedShape {
  TouchShape shape;
  RigidTransform place;
};
PlacedShape half_space(const RigidTransform& place);

// The signed distance of a point from the surface, negative where hair may not be; own axes, m. `normal` is the way out
// of the shape, of unit length; it may be null.
double shape_distance(const TouchShape& shape, const Vec3& point, Vec3* normal = nullptr);

// The radius of a ball about its origin that contains it, m.
double bounding_radius(const TouchShape& shape);

// Returns an empty string when valid: sizes are finite, at least 0 and at most kTouchSizeMax_m, and one is more than 0;
// else one line.
std::string validate(const TouchShape& shape);

}  // namespace hairnet
