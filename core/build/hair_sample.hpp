#pragma once

#include <span>
#include <vector>

#include "core/ffd/lattice.hpp"
#include "core/groom/groom.hpp"

namespace hairnet {

// Points of the hair, spread over the strands, that stand for all of it where metaballs are fitted.
struct HairSample {
  std::vector<Vec3f> points;  // head space, m
  std::vector<float> blend;   // delta of eq. 7: how much of the lattice's motion each point takes
};
HairSample sample_hair(const Groom& groom);

// The active nodes that move each point of a sample, and by how much: the quadratic FFD with the root blend, trimmed
// nodes told by the active ones that they follow. Point p has entries [begin[p], begin[p + 1]).
struct HairStencils {
  std::vector<std::uint32_t> begin{0};
  std::vector<std::uint32_t> nodes;  // active index
  std::vector<double> weights;       // > 0
};
HairStencils make_stencils(const LevelGeometry& geometry, const HairSample& hair);

// Lowers what each node may travel inwards until no point would go further than its own clearance if all nodes went in
// as far as they may: by projections onto one point's half-space after the other (Kaczmarz 1937), which change the
// travels about as little as can be. `clearance_m` >= 0, one a point; `travel_m` >= 0, one an active node.
void limit_travel(const HairStencils& stencils, std::span<const double> clearance_m, std::span<double> travel_m);

}  // namespace hairnet
