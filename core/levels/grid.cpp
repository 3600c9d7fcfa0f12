#include "core/levels/grid.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "core/assert.hpp"

namespace hairnet {

Grid::Grid(const Lattice& lattice)
    : lattice_(lattice), origin_(lattice.origin.cast<double>()), spacing_(lattice.spacing.cast<double>()) {
  HAIRNET_ASSERT(std::ranges::min(lattice.dims) >= 2);
  HAIRNET_ASSERT(origin_.allFinite());
  HAIRNET_ASSERT(spacing_.allFinite());
  HAIRNET_ASSERT(spacing_.minCoeff() > 0);
}

Vec3 Grid::from_head(const Vec3f& head) const {
  HAIRNET_VALIDATE(head.allFinite());
  // A point nearer to a plane than this, in node spacings, lies on it. A float resolves 3e-8 m at 0.3 m.
  constexpr double kOnPlane = 4e-6;
  Vec3 grid = (head.cast<double>() - origin_).cwiseQuotient(spacing_);
  for (double& x : grid) {
    if (std::abs(x - std::round(x)) < kOnPlane) x = std::round(x);
  }
  return grid;
}

Vec3 Grid::node_head(std::uint32_t node) const {
  HAIRNET_ASSERT(node < node_count());
  const auto [i, j, k] = lattice_.coordinates(node);
  return to_head(Vec3(i, j, k));
}

TrilinearWeights Grid::weights(const Vec3& grid) const {
  HAIRNET_VALIDATE(grid.allFinite());
  std::array<int, 3> base;
  Vec3 t;
  for (int axis = 0; axis < 3; ++axis) {
    base[axis] = std::clamp(static_cast<int>(std::floor(grid[axis])), 0, lattice_.dims[axis] - 2);
    t[axis] = std::clamp(grid[axis] - base[axis], 0.0, 1.0);
  }
  TrilinearWeights weights;
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
    const double weight = (i ? t[0] : 1 - t[0]) * (j ? t[1] : 1 - t[1]) * (k ? t[2] : 1 - t[2]);
    // A point on a lattice plane names the nodes of the plane alone, so it does not activate those beside it.
    if (weight == 0) continue;
    weights.entries[weights.count++] = {lattice_.index(base[0] + i, base[1] + j, base[2] + k), weight};
  }
  HAIRNET_ASSERT(weights.count > 0);
  HAIRNET_VALIDATE(std::ranges::adjacent_find(weights, std::greater_equal{}, &NodeWeight::node) == weights.end());
  HAIRNET_VALIDATE(weights.entries[weights.count - 1].node < node_count());
  HAIRNET_VALIDATE(std::abs(std::transform_reduce(weights.begin(), weights.end(), -1.0, std::plus{},
                                                  [](const NodeWeight& w) { return w.weight; })) < 1e-12);
  return weights;
}

}  // namespace hairnet
