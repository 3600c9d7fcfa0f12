#pragma once

#include <span>

#include "core/ffd/bspline.hpp"

namespace hairnet {

// One hair point at rest, in head space.
struct RestPoint {
  Vec3 x = Vec3::Zero();  // m
  // The root blend of the point.
  double delta = 1;
  // The rest tangent dx / ds along the strand, where s is the arc length at rest.
  Vec3 tangent = Vec3::Zero();
  // The slope d delta / ds, 1/m.
  double delta_slope = 0;
};

struct DeformedPoint {
  // The point in head space, m.
  Vec3 x;
  // The tangent dx / ds, where s is the arc length at rest.
  Vec3 tangent;
};

// Quadratic and linear FFD in double, one point at a time: tests compare the SIMD kernel with it. Not for production.
DeformedPoint reference_deform(const Lattice& lattice, FfdKind kind, const RestPoint& point,
                               std::span<const Vec3f> grid_displacements);

}  // namespace hairnet
