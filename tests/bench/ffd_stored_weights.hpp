#pragma once

#include <span>
#include <vector>

#include "core/ffd/bspline.hpp"

namespace hairnet::bench {

// The plain way of doing FFD: 27 nodes and weights a point (8 of the linear), found once and kept.
class StoredWeights {
 public:
  StoredWeights(const Lattice& lattice, FfdKind kind, std::span<const Vec3f> points_head, std::span<const float> blend);
  void deform(std::span<const Vec3f> grid_displacements, std::span<Vec3f> points_out) const;

 private:
  std::size_t weights_per_point_;
  std::vector<Vec3f> points_;
  // The weights are multiplied by the points' delta.
  std::vector<FfdWeight> weights_;
};

}  // namespace hairnet::bench
