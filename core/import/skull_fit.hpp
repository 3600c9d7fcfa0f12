#pragma once

#include <cstddef>
#include <span>

#include "core/geometry/vec.hpp"

namespace hairnet {

// An ellipsoid along the axes.
struct SkullFit {
  Vec3 centre = Vec3::Zero();
  Vec3 semi_axes = Vec3::Zero();
  std::size_t inlier_count = 0;
  double width = 0;  // of the inliers along x

  [[nodiscard]] double radius() const { return std::cbrt(semi_axes.prod()); }
  // About how far the point is from the surface: 0 on it, negative inside.
  [[nodiscard]] double distance(const Vec3& point) const {
    return radius() * ((point - centre).cwiseQuotient(semi_axes).norm() - 1);
  }
};

// The sphere that most points lie near, then an ellipsoid not far from it: of a scalp only the upper part is known, so
// that each axis is drawn towards the sphere. Points far from the rest (a ponytail's tail) are left out. The same
// points give the same bits. With fewer than four points, or all in a plane, a sphere of 9 cm below their middle.
SkullFit fit_skull_shape(std::span<const Vec3> points);

}  // namespace hairnet
