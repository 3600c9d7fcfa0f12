#pragma once

#include <array>
#include <cstdint>

#include "core/ffd/lattice.hpp"

namespace hairnet {

// A node and its weight in a weighted sum of nodes.
struct NodeWeight {
  // The node's index in the grid.
  std::uint32_t node = 0;
  double weight = 0;
};

// Trilinear weights of one point: its nodes with a weight other than zero, ascending by grid index; they sum to 1.
struct TrilinearWeights {
  std::array<NodeWeight, 8> entries;
  int count = 0;
  [[nodiscard]] const NodeWeight* begin() const { return entries.data(); }
  [[nodiscard]] const NodeWeight* end() const { return entries.data() + count; }
};

// A lattice in double precision. Grid coordinates count node spacings from the origin: node (i, j, k) is at (i, j, k).
// A point on a lattice plane has a whole number on that axis.
class Grid {
 public:
  // Asserts that every axis has two nodes or more and a finite spacing above 0.
  explicit Grid(const Lattice& lattice);

  [[nodiscard]] const Lattice& lattice() const { return lattice_; }
  [[nodiscard]] const Vec3& spacing() const { return spacing_; }  // m
  [[nodiscard]] std::size_t node_count() const { return lattice_.node_count(); }

  // Snaps a point that is within float rounding of a lattice plane onto the plane. Otherwise hair in a plane would
  // activate nodes of the neighbouring cells with weights of 1e-7.
  [[nodiscard]] Vec3 from_head(const Vec3f& head) const;
  [[nodiscard]] Vec3 to_head(const Vec3& grid) const { return origin_ + grid.cwiseProduct(spacing_); }
  // Asserts that the node exists.
  [[nodiscard]] Vec3 node_head(std::uint32_t node) const;
  // Length in metres of a difference of grid coordinates.
  [[nodiscard]] double length(const Vec3& grid_vector) const { return grid_vector.cwiseProduct(spacing_).norm(); }

  // A point outside the grid has the weights of the nearest point of the grid.
  [[nodiscard]] TrilinearWeights weights(const Vec3& grid) const;

 private:
  Lattice lattice_;
  Vec3 origin_, spacing_;
};

}  // namespace hairnet
