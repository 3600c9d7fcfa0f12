#pragma once

#include "core/world/character.hpp"

namespace hairnet {

bool has_level(LevelIndex level, const Character& character);

// Transfers the state by least squares (LevelSet::maps) if there is a map; otherwise the lattice starts at rest. For
// the rigid level the displacements fade out over kRigidEase_s. The learnt level begins as if the pose had been
// held, and ends at rest. Asserts that
// the character has the level.
void switch_level(LevelIndex to, Character& character);

// Other levels for the same character: a lattice of the same nodes keeps its state, any other starts at rest.
void replace_levels(std::shared_ptr<const LevelSet> levels, Character& character);

}  // namespace hairnet
