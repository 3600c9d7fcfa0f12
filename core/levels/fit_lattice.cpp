#include "core/levels/fit_lattice.hpp"

#include <algorithm>

#include "core/assert.hpp"

namespace hairnet {

Lattice fit_lattice(std::span<const Vec3f> points_head, const std::array<int, 3>& dims) {
  HAIRNET_ASSERT(std::ranges::all_of(dims, [](int n) { return n >= 3; }));
  Vec3f low = Vec3f::Zero(), high = Vec3f::Zero();
  if (!points_head.empty()) low = high = points_head.front();
  for (const Vec3f& point : points_head) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  Lattice lattice;
  lattice.dims = dims;
  for (int axis = 0; axis < 3; ++axis) {
    const double extent = static_cast<double>(high[axis]) - static_cast<double>(low[axis]);
    const double centre = 0.5 * (static_cast<double>(high[axis]) + static_cast<double>(low[axis]));
    const double spacing = std::max(extent / (dims[axis] - 2), kSpacingMin);
    lattice.spacing[axis] = static_cast<float>(spacing);
    lattice.origin[axis] = static_cast<float>(centre - 0.5 * spacing * (dims[axis] - 1));
  }
  return lattice;
}

}  // namespace hairnet
