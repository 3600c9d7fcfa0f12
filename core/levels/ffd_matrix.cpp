#include "core/levels/ffd_matrix.hpp"

#include <algorithm>

#include "core/assert.hpp"
#include "core/ffd/deform.hpp"

namespace hairnet {

ActiveCombinations::ActiveCombinations(const LevelGeometry& geometry) : combinations_(geometry.lattice.node_count()) {
  HAIRNET_ASSERT(geometry.active_nodes.size() + geometry.trimmed_nodes.size() == combinations_.size());
  HAIRNET_ASSERT(geometry.trimmed_begin.size() == geometry.trimmed_nodes.size() + 1);
  HAIRNET_ASSERT(geometry.trimmed_weights.size() == geometry.trimmed_from.size());
  HAIRNET_VALIDATE(validate(geometry).empty());
  for (std::uint32_t a = 0; a < geometry.active_nodes.size(); ++a) {
    combinations_[geometry.active_nodes[a]].push_back({a, 1});
  }
  for (std::size_t t = 0; t < geometry.trimmed_nodes.size(); ++t) {
    for (std::uint32_t e = geometry.trimmed_begin[t]; e < geometry.trimmed_begin[t + 1]; ++e) {
      combinations_[geometry.trimmed_nodes[t]].push_back(
          {geometry.trimmed_from[e], double{geometry.trimmed_weights[e]}});
    }
  }
}

void ActiveCombinations::add(std::uint32_t grid_node, double weight, Eigen::Index row, Triplets& triplets) const {
  HAIRNET_VALIDATE(grid_node < combinations_.size());
  // A trimmed node adds its weight to every active node that it follows; entries of one place add up in
  // setFromTriplets.
  for (const auto& [active, share] : combinations_[grid_node]) triplets.emplace_back(row, active, weight * share);
}

Eigen::SparseMatrix<double> ffd_matrix(const Level& level, std::span<const Vec3f> points_head,
                                       std::span<const float> blend) {
  HAIRNET_ASSERT(points_head.size() == blend.size());
  HAIRNET_ASSERT(std::ranges::min(level.geometry.lattice.dims) >= 3);
  const ActiveCombinations active(level.geometry);
  ActiveCombinations::Triplets triplets;
  for (std::size_t p = 0; p < points_head.size(); ++p) {
    for (const auto& [node, weight] : quadratic_ffd_weights(level.geometry.lattice, points_head[p])) {
      active.add(node, double{blend[p]} * double{weight}, static_cast<Eigen::Index>(p), triplets);
    }
  }
  Eigen::SparseMatrix<double> matrix(static_cast<Eigen::Index>(points_head.size()),
                                     static_cast<Eigen::Index>(level.rest.size()));
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  return matrix;
}

}  // namespace hairnet
