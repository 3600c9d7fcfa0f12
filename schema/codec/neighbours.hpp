#pragma once

#include <span>

#include "schema/codec/frame_codec.hpp"

namespace hairnet::codec {

// Grid neighbours at i + 1, j + 1 and k + 1 of a node: active indices, always higher than its own, those that are there
// first and then `absent`. Nodes are coded from the last to the first, so these are known when it is its turn; and hair
// hangs, so what is above (j + 1) tells most.
using NodeNeighbours = std::array<std::uint32_t, 3>;
inline constexpr std::uint32_t kAbsentNode = 0xFFFFFFFF;

struct NeighbourAccess {
  static std::span<const NodeNeighbours> of(const Neighbours& neighbours) { return neighbours.nodes_; }
};

}  // namespace hairnet::codec
