#pragma once

#include <Eigen/SparseCore>
#include <span>

#include "core/levels/level.hpp"

namespace hairnet {

// The matrix F, [point][node], from displacements of a level's active nodes to those of hair points. Each row is
// multiplied by the point's delta (`blend`). Asserts that there is one delta for each point.
Eigen::SparseMatrix<double> ffd_matrix(const Level& level, std::span<const Vec3f> points_head,
                                       std::span<const float> blend);

// Grid nodes as combinations of active nodes: the lists behind expand_displacements.
class ActiveCombinations {
 public:
  using Triplets = std::vector<Eigen::Triplet<double>>;

  explicit ActiveCombinations(const LevelGeometry& geometry);

  // Adds weight * (displacement of a grid node) to row `row`.
  void add(std::uint32_t grid_node, double weight, Eigen::Index row, Triplets& triplets) const;

 private:
  // For each grid node, the active nodes that it follows and their weights.
  std::vector<std::vector<std::pair<std::uint32_t, double>>> combinations_;
};

}  // namespace hairnet
