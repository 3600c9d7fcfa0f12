#pragma once

#include <cstddef>
#include <vector>

#include "core/ffd/lattice.hpp"
#include "core/modes/basis.hpp"

namespace hairnet::draw {

inline constexpr std::size_t kLatticeRow = 1024;  // texels of a row of nodes

// Rows of kLatticeRow texels for the nodes of a grid.
std::size_t node_rows(const LevelGeometry& geometry);
// Rows of the texels of a basis: mode_nodes.frag reads four modes at once.
std::size_t mode_rows(const LevelGeometry& geometry, const Basis& basis);

// The modes of a basis as mode_nodes.frag reads them: for each mode the rows of all grid nodes, with those that follow
// active nodes worked out, so that their entries are not read again for each character.
std::vector<Eigen::Vector4f> mode_texels(const LevelGeometry& geometry, const Basis& basis);

}  // namespace hairnet::draw
