#pragma once

#include "core/build/level.hpp"
#include "core/groom/groom.hpp"

namespace hairnet {

// The points of the hair at which a level's lattice meets the skin (paper 2.2: each a weighted sum of nodes, like any
// stiffener), at most `count_max`: on strands that lie as far from each other as can be, about three quarters of a cell
// apart. A point keeps as far off the skin as in the design, or the hair's thickness. Its U lets a load of 160 g on its
// share of the lattice's mass press it 5 mm nearer, so that 1 g presses it 0.4 mm. A material's metaball potential, over
// the default material's, is a factor of U.
// `mass`: of active nodes, kg.
ContactPoints make_contact_points(const Groom& groom, const LevelGeometry& geometry, std::span<const float> mass,
                                  const Skin& skin, std::size_t count_max);

}  // namespace hairnet
