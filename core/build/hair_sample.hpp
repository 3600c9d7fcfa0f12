#pragma once

#include <span>
#include <vector>

#include "core/ffd/lattice.hpp"
#include "core/groom/groom.hpp"

namespace hairnet {

// Some points of the hair.
struct HairSample {
  std::vector<Vec3f> points;  // head space, m
  std::vector<float> blend;   // delta of eq. 7: how much of the lattice's motion each point takes
};

// The active nodes that move each point of a sample, and by how much: the quadratic FFD with the root blend, trimmed
// nodes told by the active ones that they follow. Weights below a hundredth are shared out among the others. Point p has
// entries [begin[p], begin[p + 1]).
struct HairStencils {
  std::vector<std::uint32_t> begin{0};
  std::vector<std::uint32_t> nodes;  // active index
  std::vector<double> weights;       // > 0
};
HairStencils make_stencils(const LevelGeometry& geometry, const HairSample& hair);

}  // namespace hairnet
