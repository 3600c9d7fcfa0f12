#pragma once

#include <span>
#include <vector>

#include "core/ffd/lattice.hpp"
#include "core/groom/groom.hpp"

namespace hairnet {

// Points sampled from the hair.
struct HairSample {
  // Positions in head space, m.
  std::vector<Vec3f> points;
  // The delta of eq. 7: how much of the lattice's motion each point takes.
  std::vector<float> blend;
};

// An even choice of a groom's points, about `count` of them.
HairSample sample_hair(const Groom& groom, std::size_t count);

// For each point of a sample, the active nodes that move it and their weights: quadratic FFD with the root blend.
// Trimmed nodes are replaced by the active nodes that they follow. Weights below 0.01 are dropped and the others scaled
// up. Point p has entries [begin[p], begin[p + 1]). Asserts that each point has a blend.
struct HairStencils {
  std::vector<std::uint32_t> begin{0};
  // Active indices of nodes.
  std::vector<std::uint32_t> nodes;
  // Each is > 0, and the sum for a point is at most 1.
  std::vector<double> weights;
};
HairStencils make_stencils(const LevelGeometry& geometry, const HairSample& hair);

}  // namespace hairnet
