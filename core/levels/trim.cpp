#include "core/levels/trim.hpp"

#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "core/assert.hpp"
#include "core/geometry/symmetric_matrix.hpp"

namespace hairnet {
namespace {

using Vec4 = Eigen::Vector4d;
using Mat4 = Eigen::Matrix4d;

struct Neighbour {
  // The index among active nodes.
  std::uint32_t active;
  // The way from the trimmed node to the neighbour, in nodes along each axis.
  Vec3 offset;
};

// Active nodes within kTrimReach on each axis, nearest first.
std::vector<Neighbour> neighbours(const Lattice& lattice, const std::vector<std::int32_t>& active_index,
                                  std::uint32_t node) {
  HAIRNET_ASSERT(active_index[node] < 0);
  const auto [ci, cj, ck] = lattice.coordinates(node);
  std::vector<Neighbour> found;
  for (int k = std::max(ck - kTrimReach, 0); k <= std::min(ck + kTrimReach, lattice.dims[2] - 1); ++k) {
    for (int j = std::max(cj - kTrimReach, 0); j <= std::min(cj + kTrimReach, lattice.dims[1] - 1); ++j) {
      for (int i = std::max(ci - kTrimReach, 0); i <= std::min(ci + kTrimReach, lattice.dims[0] - 1); ++i) {
        const std::int32_t active = active_index[lattice.index(i, j, k)];
        if (active >= 0) found.push_back({static_cast<std::uint32_t>(active), Vec3(i - ci, j - cj, k - ck)});
      }
    }
  }
  std::ranges::stable_sort(found, {}, [](const Neighbour& n) { return n.offset.squaredNorm(); });
  return found;
}

// The weights of the mean of the neighbours, each by 1 / distance^2.
std::vector<double> mean_weights(std::span<const Neighbour> near) {
  HAIRNET_ASSERT(!near.empty());
  HAIRNET_ASSERT(near.front().offset.squaredNorm() >= 1);
  std::vector<double> weights;
  double sum = 0;
  for (const Neighbour& n : near) sum += weights.emplace_back(1 / n.offset.squaredNorm());
  for (double& w : weights) w /= sum;
  return weights;
}

// The weights of the value, at the trimmed node, of an affine function that is fitted to the neighbours by least
// squares with weights 1 / distance^2. Empty when the neighbours lie in one plane.
std::vector<double> affine_weights(std::span<const Neighbour> near) {
  Mat4 normal = Mat4::Zero();
  for (const Neighbour& n : near) {
    const Vec4 row(1, n.offset[0], n.offset[1], n.offset[2]);
    normal += row * row.transpose() / n.offset.squaredNorm();
  }
  const SymmetricEigen<4> eigen = symmetric_eigen(normal);
  // The smallest eigenvalue vanishes when the nodes say nothing about one direction.
  if (eigen.values[0] < 1e-6 * eigen.values[3]) return {};
  const Vec4 at_node = eigen.vectors * (eigen.vectors.row(0).transpose().array() / eigen.values.array()).matrix();
  std::vector<double> weights;
  for (const Neighbour& n : near) {
    const Vec4 row(1, n.offset[0], n.offset[1], n.offset[2]);
    weights.push_back(at_node.dot(row) / n.offset.squaredNorm());
  }
  HAIRNET_ASSERT(std::abs(std::accumulate(weights.begin(), weights.end(), -1.0)) < 1e-6);
  return weights;
}

// The factor by which a combination may magnify the motion of the nodes that it follows. Large weights of both signs
// sum to 1 and still turn small differences between nodes into large moves.
double amplification(std::span<const double> weights) {
  double sum = 0;
  for (const double w : weights) sum += std::abs(w);
  return sum;
}

// Blends `affine` and `mean`: as much of `affine` as the bound on the amplification allows. The weights of both, and of
// the result, sum to 1.
std::vector<double> bounded_blend(const std::vector<double>& affine, const std::vector<double>& mean) {
  HAIRNET_ASSERT(affine.size() == mean.size());
  double low = 0, high = 1;
  std::vector<double> blend(mean.size());
  for (int halving = 0; halving < 40; ++halving) {
    const double share = 0.5 * (low + high);
    for (std::size_t i = 0; i < mean.size(); ++i) blend[i] = share * affine[i] + (1 - share) * mean[i];
    (amplification(blend) <= kAmplificationMax ? low : high) = share;
  }
  for (std::size_t i = 0; i < mean.size(); ++i) blend[i] = low * affine[i] + (1 - low) * mean[i];
  HAIRNET_ASSERT(amplification(blend) <= kAmplificationMax);
  return blend;
}

// The weights with which a trimmed node follows its neighbours, in their order. Only the nearest few have a weight,
// because combinations are sent to clients. trim.hpp lists the cases.
std::vector<double> combination(std::span<const Neighbour> near) {
  HAIRNET_ASSERT(!near.empty());
  std::vector<double> affine;
  // More nodes make the fit steadier and the file of the level longer, so they are taken only when fewer amplify too
  // much.
  for (const std::size_t count : {8, 16, 32}) {
    affine = affine_weights(near.first(std::min(count, near.size())));
    if (!affine.empty() && amplification(affine) <= kAmplificationMax) return affine;
    if (count >= near.size()) break;
  }
  if (!affine.empty()) return bounded_blend(affine, mean_weights(near.first(affine.size())));
  std::vector<double> mean = mean_weights(near.first(std::min<std::size_t>(8, near.size())));
  // The motion fades to zero one node beyond the reach, where nodes have no entries at all.
  const double fade = 1 - near.front().offset.cwiseAbs().maxCoeff() / (kTrimReach + 1);
  HAIRNET_ASSERT(fade > 0);
  HAIRNET_ASSERT(fade < 1);
  for (double& w : mean) w *= fade;
  return mean;
}

}  // namespace

LevelGeometry trim(const Lattice& lattice, const std::vector<bool>& is_active) {
  HAIRNET_ASSERT(is_active.size() == lattice.node_count());
  LevelGeometry geometry;
  geometry.lattice = lattice;
  geometry.trimmed_begin = {0};
  std::vector<std::int32_t> active_index(lattice.node_count(), -1);
  for (std::uint32_t node = 0; node < lattice.node_count(); ++node) {
    if (is_active[node]) active_index[node] = static_cast<std::int32_t>(geometry.active_nodes.size());
    (is_active[node] ? geometry.active_nodes : geometry.trimmed_nodes).push_back(node);
  }
  for (const std::uint32_t node : geometry.trimmed_nodes) {
    const std::vector<Neighbour> near = neighbours(lattice, active_index, node);
    const std::vector<double> weights = near.empty() ? std::vector<double>{} : combination(near);
    HAIRNET_ASSERT(weights.size() <= near.size());
    for (std::size_t i = 0; i < weights.size(); ++i) {
      if (weights[i] == 0) continue;
      geometry.trimmed_from.push_back(near[i].active);
      geometry.trimmed_weights.push_back(static_cast<float>(weights[i]));
    }
    geometry.trimmed_begin.push_back(static_cast<std::uint32_t>(geometry.trimmed_from.size()));
  }
  HAIRNET_ASSERT(geometry.trimmed_begin.size() == geometry.trimmed_nodes.size() + 1);
  HAIRNET_VALIDATE(validate(geometry).empty());
  return geometry;
}

}  // namespace hairnet
