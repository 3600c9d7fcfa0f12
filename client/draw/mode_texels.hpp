#pragma once

#include <cstddef>
#include <vector>

#include "core/ffd/lattice.hpp"
#include "core/modes/basis.hpp"

namespace hairnet::draw {

// Texels in a row of nodes. The shaders have the same number.
inline constexpr std::size_t kLatticeRow = 1024;

// How many rows of kLatticeRow texels the nodes of a grid take.
std::size_t node_rows(const LevelGeometry& geometry);
// How many rows the texels of a basis take: mode_nodes.frag reads four modes at once, so the last group is filled up
// with zeros.
std::size_t mode_rows(const LevelGeometry& geometry, const Basis& basis);

// The modes of a basis as mode_nodes.frag reads them: for each mode the rows of all grid nodes. Trimmed nodes, which
// follow active nodes, are worked out here once, so that the shader needs no lists of entries for them.
std::vector<Eigen::Vector4f> mode_texels(const LevelGeometry& geometry, const Basis& basis);

}  // namespace hairnet::draw
