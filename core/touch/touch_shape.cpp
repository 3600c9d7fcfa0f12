#include "core/touch/touch_shape.hpp"

#include <algorithm>

namespace hairnet {
namespace {

// The axis of the nearest face of a box, for a point inside. Among equally near faces y comes first.
Eigen::Index nearest_face(const Vec3& beyond) {
  Eigen::Index axis = 1;
  for (const Eigen::Index other : {0, 2}) {
    if (beyond[other] > beyond[axis]) axis = other;
  }
  return axis;
}

}  // namespace

PlacedShape half_space(const RigidTransform& place) {
  // Steps measure the depth from the middle of the box in float. The box is only 10 m deep, so that this loses less
  // than a micrometre.
  const Vec3 half_size_m(kTouchSizeMax_m, 5, kTouchSizeMax_m);
  // The rotation is normalised, since 5 m would turn its allowed error (kTouchRotationTolerance) into millimetres.
  return {box(half_size_m),
          {place.rotation, place.position - place.rotation.normalized() * Vec3(0, half_size_m.y(), 0)}};
}

double shape_distance(const TouchShape& shape, const Vec3& point, Vec3* normal) {
  const Vec3 beyond = point.cwiseAbs() - shape.half_size_m;
  const Vec3 outside = beyond.cwiseMax(0.0);
  // A point may be so far away, or so near, that squares overflow or vanish.
  const double outside_m = outside.stableNorm();
  const double sign = shape.is_inside_out ? -1 : 1;
  const auto side = [&](Eigen::Index axis) { return point[axis] < 0 ? -sign : sign; };
  const Eigen::Index face = nearest_face(beyond);
  if (normal && outside_m > 0) *normal = Vec3(side(0), side(1), side(2)).cwiseProduct(outside) / outside_m;
  // Inside the box the way out is through the nearest face.
  if (normal && !(outside_m > 0)) *normal = side(face) * Vec3::Unit(face);
  return sign * (outside_m + std::min(beyond[face], 0.0) - shape.radius_m);
}

double bounding_radius(const TouchShape& shape) {
  return shape.half_size_m.norm() + shape.radius_m;
}

std::string validate(const TouchShape& shape) {
  // Written so that NaN fails.
  const auto is_size = [](double size_m) { return size_m >= 0 && size_m <= kTouchSizeMax_m; };
  const Vec3& half = shape.half_size_m;
  if (!is_size(half.x()) || !is_size(half.y()) || !is_size(half.z()) || !is_size(shape.radius_m))
    return "shape: a size is not between 0 and 100 m";
  return half.isZero(0) && shape.radius_m == 0 ? "shape: it has no size" : "";
}

}  // namespace hairnet
