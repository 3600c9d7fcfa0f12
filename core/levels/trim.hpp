#pragma once

#include <vector>

#include "core/ffd/lattice.hpp"

namespace hairnet {

// Divides the grid's nodes into active nodes (`is_active`, one entry for each grid node) and trimmed ones, and gives
// each trimmed node a fixed combination of active nodes' displacements:
// - an affine function fitted to active nodes around it, if there are at least four within two nodes on each axis, not
//   all in one plane, and the amplification is at most kAmplificationMax;
// - if the amplification is larger: a blend of this function and the weighted mean of these nodes that meets the bound;
// - if they lie in one plane: their weighted mean, fading with distance;
// - if the node is farther than two nodes from any active one: no entries, no displacement.
// Asserts that `is_active` has one entry for each grid node.
LevelGeometry trim(const Lattice& lattice, const std::vector<bool>& is_active);

// The distance, in nodes along an axis, up to which active nodes determine a trimmed one.
inline constexpr int kTrimReach = 2;
// The greatest sum of the absolute values of a trimmed node's weights.
inline constexpr double kAmplificationMax = 3;

}  // namespace hairnet
