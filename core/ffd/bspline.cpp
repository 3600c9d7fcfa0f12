#include "core/ffd/bspline.hpp"

#include <algorithm>
#include <cmath>

#include "core/assert.hpp"

namespace hairnet {
namespace {

// Weights of the stencil's nodes along one axis (quadratic B-spline, paper 4). Beyond half a spacing from the middle
// node of the outermost stencil the border nodes extrapolate linearly; value and slope are continuous there.
std::array<float, 3> quadratic_weights(float t) {
  if (t < -0.5f) return {-t, 1 + t, 0};
  if (t > 0.5f) return {0, 1 - t, t};
  return {0.5f * (0.5f - t) * (0.5f - t), 0.75f - t * t, 0.5f * (0.5f + t) * (0.5f + t)};
}

}  // namespace

FfdSite ffd_site(const Lattice& lattice, FfdKind kind, const Vec3f& point_head) {
  const bool quadratic = kind == FfdKind::quadratic;
  HAIRNET_VALIDATE(std::ranges::min(lattice.dims) >= (quadratic ? 3 : 2));
  const Vec3f g = (point_head - lattice.origin).cwiseQuotient(lattice.spacing);
  std::array<int, 3> lowest{};
  FfdSite site{0, Vec3f::Zero(), false};
  for (int a = 0; a < 3; ++a) {
    const auto axis = static_cast<std::size_t>(a);
    // Clamped as float: a point may be so far away that its node index does not fit an int.
    const float low = quadratic ? 1.0f : 0.0f, high = static_cast<float>(lattice.dims[axis] - 2);
    const float nearest = std::fmin(std::fmax(quadratic ? std::round(g[a]) : std::floor(g[a]), low), high);
    lowest[axis] = static_cast<int>(nearest) - (quadratic ? 1 : 0);
    // The outermost stencils serve everything beyond them too, so `t` may have any size there.
    site.t[a] = g[a] - nearest;
    site.outside |= quadratic ? std::abs(site.t[a]) > 0.5f : site.t[a] < 0 || site.t[a] > 1;
  }
  site.base = lattice.index(lowest[0], lowest[1], lowest[2]);
  HAIRNET_VALIDATE(site.base < lattice.node_count());
  return site;
}

std::array<FfdWeight, 27> quadratic_ffd_weights(const Lattice& lattice, const Vec3f& point_head) {
  const FfdSite site = ffd_site(lattice, FfdKind::quadratic, point_head);
  const auto row = static_cast<std::uint32_t>(lattice.dims[0]);
  const auto slice = row * static_cast<std::uint32_t>(lattice.dims[1]);
  const std::array<std::array<float, 3>, 3> w{quadratic_weights(site.t.x()), quadratic_weights(site.t.y()),
                                              quadratic_weights(site.t.z())};
  std::array<FfdWeight, 27> weights;
  for (std::uint32_t e = 0; e < 27; ++e) {
    const std::uint32_t i = e % 3, j = e / 3 % 3, k = e / 9;
    weights[e] = {site.base + i + j * row + k * slice, w[0][i] * w[1][j] * w[2][k]};
  }
  HAIRNET_ASSERT(weights.back().node < lattice.node_count());
  return weights;
}

}  // namespace hairnet
