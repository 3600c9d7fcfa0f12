#include "core/ffd/reference_deform.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "core/assert.hpp"

namespace hairnet {
namespace {

// Along one axis: the lowest node of the stencil, the weights w_j of its nodes, and dw_j / dx in 1/m.
struct AxisWeights {
  int lowest = 0;
  int count = 0;
  std::array<double, 3> w{}, slope{};
};

AxisWeights quadratic_axis(double g, double spacing, int node_count) {
  HAIRNET_ASSERT(node_count >= 3);
  HAIRNET_ASSERT(spacing > 0);
  const double middle = std::clamp(std::round(g), 1.0, node_count - 2.0), t = g - middle;
  AxisWeights axis{static_cast<int>(middle) - 1, 3, {}, {}};
  if (t < -0.5) {
    // Beyond the grid the weights are linear from its border.
    axis.w = {-t, 1 + t, 0};
    axis.slope = {-1, 1, 0};
  } else if (t > 0.5) {
    axis.w = {0, 1 - t, t};
    axis.slope = {0, -1, 1};
  } else {
    axis.w = {0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)};
    axis.slope = {t - 0.5, -2 * t, t + 0.5};
  }
  for (double& slope : axis.slope) slope /= spacing;
  return axis;
}

AxisWeights linear_axis(double g, double spacing, int node_count) {
  HAIRNET_ASSERT(node_count >= 2);
  HAIRNET_ASSERT(spacing > 0);
  const double lowest = std::clamp(std::floor(g), 0.0, node_count - 2.0), t = g - lowest;
  return {static_cast<int>(lowest), 2, {1 - t, t, 0}, {-1 / spacing, 1 / spacing, 0}};
}

}  // namespace

DeformedPoint reference_deform(const Lattice& lattice, FfdKind kind, const RestPoint& point,
                               std::span<const Vec3f> grid_displacements) {
  HAIRNET_ASSERT(grid_displacements.size() == lattice.node_count());
  const Vec3 origin = lattice.origin.cast<double>(), spacing = lattice.spacing.cast<double>();
  std::array<AxisWeights, 3> axes;
  for (int a = 0; a < 3; ++a) {
    const auto axis = static_cast<std::size_t>(a);
    const double g = (point.x[a] - origin[a]) / spacing[a];
    axes[axis] = kind == FfdKind::quadratic ? quadratic_axis(g, spacing[a], lattice.dims[axis])
                                            : linear_axis(g, spacing[a], lattice.dims[axis]);
  }
  const auto& [X, Y, Z] = axes;
  // The sum of w_j p_j over the stencil, and its derivative along the tangent.
  Vec3 sum = Vec3::Zero();
  Vec3 slope = Vec3::Zero();
  for (int k = 0; k < Z.count; ++k) {
    for (int j = 0; j < Y.count; ++j) {
      for (int i = 0; i < X.count; ++i) {
        const std::array<int, 3> at{X.lowest + i, Y.lowest + j, Z.lowest + k};
        // The sum goes over places of nodes, as in the paper; the kernel sums displacements. Both are equal, since the
        // weights reproduce any affine lattice.
        const Vec3 p = origin + Vec3(at[0], at[1], at[2]).cwiseProduct(spacing) +
                       grid_displacements[lattice.index(at[0], at[1], at[2])].cast<double>();
        const auto [x, y, z] =
            std::tuple(static_cast<std::size_t>(i), static_cast<std::size_t>(j), static_cast<std::size_t>(k));
        const double w = X.w[x] * Y.w[y] * Z.w[z];
        const Vec3 gradient(X.slope[x] * Y.w[y] * Z.w[z], X.w[x] * Y.slope[y] * Z.w[z], X.w[x] * Y.w[y] * Z.slope[z]);
        sum += w * p;
        slope += gradient.dot(point.tangent) * p;
      }
    }
  }
  // Paper eq. 7, in head space, where R x^0 is x^0; then its derivative by the arc length.
  const double delta = point.delta;
  return {(1 - delta) * point.x + delta * sum,
          (1 - delta) * point.tangent + delta * slope + point.delta_slope * (sum - point.x)};
}

}  // namespace hairnet
