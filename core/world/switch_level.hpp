#pragma once

#include "core/world/character.hpp"

namespace hairnet {

// The state is carried over by least squares (LevelSet::maps) where there is a map; else the lattice starts at rest.
// Into the rigid level it is eased over kRigidEase_s. `substep_s`: of the world. The level must be there.
void switch_level(LevelIndex to, double substep_s, Character& character);

// Other levels for the same character: a lattice of the same nodes keeps its state, any other starts at rest.
void replace_levels(std::shared_ptr<const LevelSet> levels, double substep_s, Character& character);

}  // namespace hairnet
