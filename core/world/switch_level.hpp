#pragma once

#include "core/world/character.hpp"

namespace hairnet {

// The state is carried over by least squares (LevelSet::maps) where there is a map; else the lattice starts at rest.
// Into the rigid level it is eased over kRigidEase_s. The level must be there.
void switch_level(LevelIndex to, Character& character);

// Other levels for the same character: a lattice of the same nodes keeps its state, any other starts at rest.
void replace_levels(std::shared_ptr<const LevelSet> levels, Character& character);

}  // namespace hairnet
