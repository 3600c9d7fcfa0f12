#pragma once

#include "core/world/character.hpp"

namespace hairnet {

// Whether the character can be on this level: its groom's levels are there and, for the learnt level, its network. The
// rigid level is always possible.
bool has_level(LevelIndex level, const Character& character);

// Puts the character on another level, and wakes it. Where the LevelSet has a map, displacements and velocities are
// transferred by least squares; otherwise the lattice starts at rest.
//
// The rigid level begins when the displacements have faded out over kRigidEase_s; a switch to another level in the
// meantime ends the fading. The learnt level begins as if the pose had been held, and a lattice after it starts at
// rest. Hands lose their hair, since each level has its own contact points. Asserts has_level().
void switch_level(LevelIndex to, Character& character);

// Gives the character other levels. A lattice with the same nodes keeps its state, as when only the material differs;
// any other starts at rest. A level that the new set lacks becomes rigid.
void replace_levels(std::shared_ptr<const LevelSet> levels, Character& character);

}  // namespace hairnet
