#pragma once

#include "core/groom/groom.hpp"
#include "core/levels/level.hpp"

namespace hairnet {

// Chooses at most `count_max` points of the hair where contact with the skin acts. Like a stiffener, each point is a
// weighted sum of nodes (paper 2.2). The points lie about three quarters of a cell apart, on strands as far from each
// other as possible. Contact begins at the smaller of two distances to the skin: the point's own in the design, and
// the hair's thickness. U is chosen so that a load of 160 g on the point's share of the mass presses it 5 mm in, and 1
// g 0.4 mm. U is scaled by the material's metaball potential over the default material's. `mass`: of active nodes, kg.
// Asserts that there is one mass for each active node.
ContactPoints make_contact_points(const Groom& groom, const LevelGeometry& geometry, std::span<const float> mass,
                                  const Skin& skin, std::size_t count_max);

}  // namespace hairnet
