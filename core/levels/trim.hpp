#pragma once

#include <vector>

#include "core/ffd/lattice.hpp"

namespace hairnet {

// Parts the grid's nodes into active ones (`is_active`, one entry a grid node) and trimmed ones, and gives each trimmed
// node its fixed combination of active nodes' displacements:
// - by an affine function fitted to active nodes around it, where these allow: at least four within two nodes on each
//   axis, not all in one plane, and no amplification beyond kAmplificationMax;
// - else as much of that as keeps the amplification, the rest the weighted mean of these nodes;
// - in one plane: their weighted mean, fading with distance;
// - farther than two nodes from any active one: no entries, no displacement.
LevelGeometry trim(const Lattice& lattice, const std::vector<bool>& is_active);

inline constexpr int kTrimReach = 2;            // nodes an axis
inline constexpr double kAmplificationMax = 3;  // sum of the weights' absolute values

}  // namespace hairnet
