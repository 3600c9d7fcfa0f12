#include "tests/bench/ffd_stored_weights.hpp"

namespace hairnet::bench {
namespace {

void append_linear(const Lattice& lattice, const Vec3f& point, std::vector<FfdWeight>& weights) {
  const FfdSite site = ffd_site(lattice, FfdKind::linear, point);
  const std::array<int, 3> at = lattice.coordinates(site.base);
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
    const float weight =
        (i ? site.t.x() : 1 - site.t.x()) * (j ? site.t.y() : 1 - site.t.y()) * (k ? site.t.z() : 1 - site.t.z());
    weights.push_back({lattice.index(at[0] + i, at[1] + j, at[2] + k), weight});
  }
}

// The number of weights of a point is known when compiled (8 linear, 27 quadratic), so that the compiler may unroll the
// loop.
template <std::size_t kCount>
void add_displacements(std::span<const Vec3f> points, const FfdWeight* weights, const Vec3f* displacements,
                       Vec3f* points_out) {
  for (std::size_t p = 0; p < points.size(); ++p) {
    float x = points[p].x(), y = points[p].y(), z = points[p].z();
    for (std::size_t e = 0; e < kCount; ++e) {
      const auto [node, weight] = weights[kCount * p + e];
      const float* d = displacements[node].data();
      x += weight * d[0];
      y += weight * d[1];
      z += weight * d[2];
    }
    points_out[p] = {x, y, z};
  }
}

}  // namespace

StoredWeights::StoredWeights(const Lattice& lattice, FfdKind kind, std::span<const Vec3f> points_head,
                             std::span<const float> blend)
    : weights_per_point_(kind == FfdKind::quadratic ? 27 : 8), points_(points_head.begin(), points_head.end()) {
  for (std::size_t p = 0; p < points_.size(); ++p) {
    if (kind == FfdKind::quadratic) {
      for (const FfdWeight& weight : quadratic_ffd_weights(lattice, points_[p])) weights_.push_back(weight);
    } else {
      append_linear(lattice, points_[p], weights_);
    }
    for (std::size_t e = weights_.size() - weights_per_point_; e < weights_.size(); ++e) weights_[e].weight *= blend[p];
  }
}

void StoredWeights::deform(std::span<const Vec3f> grid_displacements, std::span<Vec3f> points_out) const {
  if (weights_per_point_ == 27) {
    add_displacements<27>(points_, weights_.data(), grid_displacements.data(), points_out.data());
  } else {
    add_displacements<8>(points_, weights_.data(), grid_displacements.data(), points_out.data());
  }
}

}  // namespace hairnet::bench
