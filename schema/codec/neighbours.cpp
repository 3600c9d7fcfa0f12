#include "schema/codec/neighbours.hpp"

#include <algorithm>

#include "core/assert.hpp"

namespace hairnet::codec {

Neighbours::Neighbours(const LevelGeometry& geometry) {
  const std::vector<std::uint32_t>& active = geometry.active_nodes;
  HAIRNET_ASSERT(active.empty() || active.back() < geometry.lattice.node_count());
  HAIRNET_VALIDATE(std::ranges::is_sorted(active));
  nodes_.reserve(active.size());
  for (const std::uint32_t node : active) {
    NodeNeighbours& found = nodes_.emplace_back();
    found.fill(kAbsentNode);
    const std::array<int, 3> at = geometry.lattice.coordinates(node);
    std::size_t count = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::array<int, 3> next = at;
      if (++next[axis] == geometry.lattice.dims[axis]) continue;
      const std::uint32_t grid_index = geometry.lattice.index(next[0], next[1], next[2]);
      const auto place = std::ranges::lower_bound(active, grid_index);
      if (place != active.end() && *place == grid_index)
        found[count++] = static_cast<std::uint32_t>(place - active.begin());
    }
    HAIRNET_VALIDATE(std::ranges::all_of(found, [&](std::uint32_t n) { return n >= nodes_.size(); }));
  }
}

std::size_t Neighbours::node_count() const {
  return nodes_.size();
}

}  // namespace hairnet::codec
