#pragma once

#include <span>

#include "schema/codec/frame_codec.hpp"

namespace hairnet::codec {

// The grid neighbours of a node at i + 1, j + 1 and k + 1, as active indices; existing ones first, then kAbsentNode.
// They are always higher than the node's own index. Nodes are coded from the last to the first, so the neighbours are
// known by then. Hair hangs down, so the node above (j + 1) predicts best.
using NodeNeighbours = std::array<std::uint32_t, 3>;
inline constexpr std::uint32_t kAbsentNode = 0xFFFFFFFF;

struct NeighbourAccess {
  static std::span<const NodeNeighbours> of(const Neighbours& neighbours) { return neighbours.nodes_; }
};

}  // namespace hairnet::codec
