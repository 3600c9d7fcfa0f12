#pragma once

#include <Eigen/SparseCore>
#include <span>

#include "core/levels/level.hpp"

namespace hairnet {

// F: maps displacements of a level's active nodes to displacements of hair points, each times its delta: [point][node].
// Asserts that there is one delta for each point.
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
  std::vector<std::vector<std::pair<std::uint32_t, double>>> combinations_;
};

}  // namespace hairnet
