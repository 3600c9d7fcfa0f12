#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

#include "core/levels/level.hpp"
#include "core/parallel_for.hpp"

namespace hairnet {

// Transfers a lattice state from one level to another. The new displacements are the least-squares fit for which
// quadratic FFD moves the hair points as the old level does; velocities likewise. A node that no hair point depends on
// takes the linearly interpolated value of the old lattice at its position. Levels with the same nodes are copied
// without change. Immutable; all threads may share it.
class LevelMap {
 public:
  // `points_head`: hair points at rest. `blend`: delta of each point (root_blend); points with a small delta count
  // little. Asserts that there is one delta for each point, and that both levels have nodes.
  LevelMap(const Level& from, const Level& to, std::span<const Vec3f> points_head, std::span<const float> blend);

  // Makes all maps of a set in less time: the matrices of each level are computed once and shared by its maps.
  friend void make_level_maps(LevelSet& set, std::span<const Vec3f> points_head, std::span<const float> blend,
                              const ParallelFor& parallel_for);

  // Head space. Asserts that there is one entry for each active node.
  void apply(std::span<const Vec3f> from, std::span<Vec3f> to) const;
  // [node of the new level][node of the old one]; empty when both have the same nodes.
  [[nodiscard]] const Eigen::MatrixXf& matrix() const { return matrix_; }
  // The memory that the map takes.
  [[nodiscard]] std::size_t bytes() const {
    return sizeof(LevelMap) + static_cast<std::size_t>(matrix_.size()) * sizeof(float);
  }

 private:
  struct End;
  LevelMap(const End& from, const End& to);

  Eigen::MatrixXf matrix_;
};

// Makes the maps between all levels of a set.
void make_level_maps(LevelSet& set, std::span<const Vec3f> points_head, std::span<const float> blend,
                     const ParallelFor& parallel_for = {});

}  // namespace hairnet
