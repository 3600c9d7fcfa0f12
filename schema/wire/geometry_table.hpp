#pragma once

#include <algorithm>
#include <string>

#include "core/ffd/lattice.hpp"
#include "schema/limits.hpp"
#include "schema/wire/flatbuffer_convert.hpp"

namespace hairnet::wire {

// Reads a table with the fields of LevelGeometry. Returns an empty string when it is valid, else one line.
template <class Table>
std::string read_geometry(const Table& in, LevelGeometry& out) {
  Lattice& lattice = out.lattice;
  lattice.origin = from_flatbuffer(*in.origin());
  lattice.spacing = from_flatbuffer(*in.spacing());
  const std::array<std::uint32_t, 3> dims{in.node_count_x(), in.node_count_y(), in.node_count_z()};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // The limit also keeps the number of all nodes within an int.
    if (dims[axis] > kLatticeNodesPerAxisMax)
      return std::to_string(dims[axis]) + " nodes on an axis, more than " + std::to_string(kLatticeNodesPerAxisMax);
    lattice.dims[axis] = static_cast<int>(dims[axis]);
  }
  const float farthest_m = std::max(lattice.origin.cwiseAbs().maxCoeff(), lattice.spacing.cwiseAbs().maxCoeff());
  if (!lattice.origin.allFinite() || !lattice.spacing.allFinite() || !(farthest_m <= kLatticeCoordinateMax_m))
    return "lattice not finite or too large";
  from_flatbuffer(*in.active_nodes(), out.active_nodes);
  from_flatbuffer(*in.trimmed_nodes(), out.trimmed_nodes);
  from_flatbuffer(*in.trimmed_begin(), out.trimmed_begin);
  from_flatbuffer(*in.trimmed_from(), out.trimmed_from);
  from_flatbuffer(*in.trimmed_weights(), out.trimmed_weights);
  return validate(out);
}

}  // namespace hairnet::wire
