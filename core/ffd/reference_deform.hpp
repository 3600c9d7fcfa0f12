#pragma once

#include <span>

#include "core/ffd/bspline.hpp"

namespace hairnet {

// One hair point at rest, in head space.
struct RestPoint {
  Vec3 x = Vec3::Zero();        // m
  double delta = 1;             // root blend
  Vec3 tangent = Vec3::Zero();  // dx / ds along the strand
  double delta_slope = 0;       // d delta / ds, 1/m
};

struct DeformedPoint {
  Vec3 x;        // head space, m
  Vec3 tangent;  // dx / ds, s the arc length at rest
};

// Quadratic and linear FFD in double, one point at a time: tests compare the SIMD kernel with it. Not for production.
DeformedPoint reference_deform(const Lattice& lattice, FfdKind kind, const RestPoint& point,
                               std::span<const Vec3f> grid_displacements);

}  // namespace hairnet
