#pragma once

#include "core/build/level.hpp"
#include "core/groom/groom.hpp"

namespace hairnet {

// The points of the hair at which a level's lattice meets the skin (paper 2.2: a weighted sum of nodes, like any
// stiffener), at most `count_max`: strands that lie and end as far from each other as can be, each a point about every
// half cell. A point keeps as far off the skin as in the design, or the hair's thickness; U lets a load of kLoadG times
// its share of the lattice's mass come 5 mm nearer, or is the material's. `mass`: of active nodes, kg.
ContactPoints make_contact_points(const Groom& groom, const LevelGeometry& geometry, std::span<const float> mass,
                                  const Skin& skin, std::size_t count_max);

}  // namespace hairnet
