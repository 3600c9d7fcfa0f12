#include "core/ffd/deform.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace hairnet {
namespace {

// Weights of the stencil's nodes along one axis (model section 7). Beyond half a spacing outside the middle node of the
// outermost stencil the border nodes extrapolate linearly, which meets the parabola in value and slope.
std::array<float, 3> quadratic_weights(float t) {
  if (t < -0.5f) return {-t, 1 + t, 0};
  if (t > 0.5f) return {0, 1 - t, t};
  return {0.5f * (0.5f - t) * (0.5f - t), 0.75f - t * t, 0.5f * (0.5f + t) * (0.5f + t)};
}

std::array<float, 2> linear_weights(float t) {
  return {1 - t, t};
}

template <std::size_t N>
Vec3f weighted_sum(const Lattice& lattice, std::uint32_t base, const std::array<std::array<float, N>, 3>& w,
                   std::span<const Vec3f> displacements) {
  const auto row = static_cast<std::uint32_t>(lattice.dims[0]);
  const auto slice = row * static_cast<std::uint32_t>(lattice.dims[1]);
  Vec3f sum = Vec3f::Zero();
  for (std::uint32_t k = 0; k < N; ++k) {
    for (std::uint32_t j = 0; j < N; ++j) {
      const Vec3f* node = displacements.data() + base + j * row + k * slice;
      const float wjk = w[1][j] * w[2][k];
      for (std::size_t i = 0; i < N; ++i) sum += (w[0][i] * wjk) * node[i];
    }
  }
  return sum;
}

Deformer::Site site_of(const Lattice& lattice, FfdKind kind, const Vec3f& point) {
  const bool quadratic = kind == FfdKind::quadratic;
  const Vec3f g = (point - lattice.origin).cwiseQuotient(lattice.spacing);
  std::array<int, 3> lowest{};
  Vec3f t;
  for (int a = 0; a < 3; ++a) {
    const auto axis = static_cast<std::size_t>(a);
    // Clamped as float: a point may be so far away that its node index has no int.
    const float nearest = quadratic ? std::clamp(std::round(g[a]), 1.0f, static_cast<float>(lattice.dims[axis] - 2))
                                    : std::clamp(std::floor(g[a]), 0.0f, static_cast<float>(lattice.dims[axis] - 2));
    lowest[axis] = static_cast<int>(nearest) - (quadratic ? 1 : 0);
    t[a] = g[a] - nearest;
  }
  return {lattice.index(lowest[0], lowest[1], lowest[2]), t};
}

}  // namespace

std::array<FfdWeight, 27> quadratic_ffd_weights(const Lattice& lattice, const Vec3f& point_head) {
  const auto [base, t] = site_of(lattice, FfdKind::quadratic, point_head);
  const auto row = static_cast<std::uint32_t>(lattice.dims[0]);
  const auto slice = row * static_cast<std::uint32_t>(lattice.dims[1]);
  const std::array<std::array<float, 3>, 3> w{quadratic_weights(t.x()), quadratic_weights(t.y()),
                                              quadratic_weights(t.z())};
  std::array<FfdWeight, 27> weights;
  for (std::uint32_t e = 0; e < 27; ++e) {
    const std::uint32_t i = e % 3, j = e / 3 % 3, k = e / 9;
    weights[e] = {base + i + j * row + k * slice, w[0][i] * w[1][j] * w[2][k]};
  }
  return weights;
}

std::vector<float> root_blend(const Groom& groom) {
  std::vector<float> blend(groom.points.size(), 1.0f);
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    const float lambda_0 = groom.strands[s].root_length_m;
    if (!groom.strands[s].rooted || lambda_0 <= 0) continue;
    double lambda = 0;
    for (std::uint32_t i = groom.strand_begin[s]; i < groom.strand_begin[s + 1]; ++i) {
      if (i > groom.strand_begin[s]) lambda += static_cast<double>((groom.points[i] - groom.points[i - 1]).norm());
      const double ratio = lambda / static_cast<double>(lambda_0);
      blend[i] = static_cast<float>(-std::expm1(-ratio * ratio));
    }
  }
  return blend;
}

Deformer::Deformer(const Lattice& lattice, std::span<const Vec3f> points_head, std::span<const float> blend,
                   FfdKind kind)
    : lattice_(lattice),
      kind_(kind),
      points_(points_head.begin(), points_head.end()),
      blend_(blend.begin(), blend.end()) {
  assert(blend_.empty() || blend_.size() == points_.size());
  assert(kind == FfdKind::linear || *std::min_element(lattice.dims.begin(), lattice.dims.end()) >= 3);
  sites_.reserve(points_.size());
  for (const Vec3f& x : points_) sites_.push_back(site_of(lattice, kind, x));
}

Deformer::Deformer(const Groom& groom, const Lattice& lattice, FfdKind kind)
    : Deformer(lattice, groom.points, root_blend(groom), kind) {}

void Deformer::deform(std::span<const Vec3f> grid_displacements, std::span<Vec3f> points_out) const {
  assert(grid_displacements.size() == lattice_.node_count() && points_out.size() == points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const auto& [base, t] = sites_[i];
    const Vec3f moved =
        kind_ == FfdKind::quadratic
            ? weighted_sum<3>(lattice_, base,
                              {quadratic_weights(t.x()), quadratic_weights(t.y()), quadratic_weights(t.z())},
                              grid_displacements)
            : weighted_sum<2>(lattice_, base, {linear_weights(t.x()), linear_weights(t.y()), linear_weights(t.z())},
                              grid_displacements);
    points_out[i] = points_[i] + (blend_.empty() ? 1.0f : blend_[i]) * moved;
  }
}

}  // namespace hairnet
