#pragma once

#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/triangle_mesh.hpp"
#include "core/geometry/vec.hpp"
#include "core/groom/body.hpp"

namespace hairnet {

// The radius of a usual adult skull with its skin.
inline constexpr double kUsualSkullRadius_m = 0.09;

// An ellipsoid along the axes. All lengths are in the unit of the points.
struct SkullFit {
  Vec3 centre = Vec3::Zero();
  Vec3 semi_axes = Vec3::Zero();
  // The points near the ellipsoid.
  std::vector<Vec3> inliers;
  // The smallest eigenvalue of the information of a point about centre and radius, on average: 0 in a plane, 0.03 to
  // 0.13 for a scalp. It falls where roots cover less of the sphere, since then a larger and more distant sphere fits
  // as well.
  double conditioning = 0;

  // Whether the points determine it; if not, it is a sphere of about the usual size.
  [[nodiscard]] bool is_determined() const { return conditioning > 0.01; }
  [[nodiscard]] double radius() const { return std::cbrt(semi_axes.prod()); }
  // The approximate distance of the point from the surface: 0 on it, negative inside.
  [[nodiscard]] double distance(const Vec3& point) const {
    return radius() * ((point - centre).cwiseQuotient(semi_axes).norm() - 1);
  }
  // The head joint in head axes: at the base of the skull, a little behind its middle. All offsets are shares of the
  // radius, so it holds in any unit.
  [[nodiscard]] Vec3 joint() const { return centre + radius() * Vec3(0, -0.8, -0.1); }
};

// Fits the sphere near most points, then an ellipsoid close to it: a scalp shows only the upper part, so each axis is
// pulled towards the sphere. Outliers (a ponytail's tail) are ignored. Where the points do not determine the size, for
// example in a strip or a small patch, the radius is pulled towards `usual_radius`. The same points give the same bits.
// `points` need no order; at most about 4000 of them are used. Fewer than 4 give a usual skull under their mean.
SkullFit fit_skull_shape(std::span<const Vec3> points, double usual_radius = kUsualSkullRadius_m);

// The skull under the uppermost 10 cm of a head, bust or person, in head axes and metres, for any origin; each part of
// the surface counts by its area. None if this part is not a skull.
std::optional<SkullFit> skull_of_mesh(const TriangleMesh& mesh);

// An ellipsoid's mesh that moves with the head. `skull` is in head space. Its bone weights follow the head alone, so
// this body has no neck or shoulders for hair to lie on.
Body skull_body(const SkullFit& skull);

}  // namespace hairnet
