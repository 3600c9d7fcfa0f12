#include "core/levels/fit_lattice.hpp"

#include <algorithm>

#include "core/assert.hpp"

namespace hairnet {

Lattice fit_lattice(std::span<const Vec3f> points_head, const std::array<int, 3>& dims) {
  HAIRNET_ASSERT(std::ranges::min(dims) >= 3);
  Vec3f low = Vec3f::Zero(), high = Vec3f::Zero();
  if (!points_head.empty()) low = high = points_head.front();
  for (const Vec3f& point : points_head) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  Lattice lattice;
  lattice.dims = dims;
  // The lattice is centred on the box, so both sides get the same margin. FFD then needs no extrapolation for hair in
  // the design.
  for (int axis = 0; axis < 3; ++axis) {
    const double extent = static_cast<double>(high[axis]) - static_cast<double>(low[axis]);
    const double centre = 0.5 * (static_cast<double>(high[axis]) + static_cast<double>(low[axis]));
    const double spacing = std::max(extent / (dims[axis] - 2), kSpacingMin);
    lattice.spacing[axis] = static_cast<float>(spacing);
    lattice.origin[axis] = static_cast<float>(centre - 0.5 * spacing * (dims[axis] - 1));
  }
  HAIRNET_ASSERT(lattice.origin.allFinite());
  HAIRNET_ASSERT(lattice.spacing.allFinite());
  HAIRNET_VALIDATE(std::ranges::all_of(points_head, [&](const Vec3f& point) {
    const Vec3f end = lattice.node(lattice.index(dims[0] - 1, dims[1] - 1, dims[2] - 1));
    return (point - lattice.origin).minCoeff() > 0 && (end - point).minCoeff() > 0;
  }));
  return lattice;
}

}  // namespace hairnet
