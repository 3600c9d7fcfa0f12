#include "schema/codec/code_nodes.hpp"

#include "schema/codec/frame_nodes.hpp"

namespace hairnet::codec {

void encode_nodes(const NodeWalk& walk, const std::int16_t* nodes, BitWriter& writer) {
  check_walk(walk);
  HAIRNET_ASSERT(nodes);
  const std::array<std::uint32_t, 4> weights = size_weights(walk.expectation);
  BitWriter out = writer;  // a copy, which stays in registers
  std::uint32_t size = 0;
  for (std::uint32_t i = walk.count; i-- > 0;) {
    const std::int16_t* node = nodes + 3 * i;
    const NodeContext around = make_node_context(walk, i, weights, size);
    ZigzagNode z;
    for (unsigned axis = 0; axis < 3; ++axis)
      z[axis] = zigzag(static_cast<std::int16_t>(node[axis] - around.expected[axis]));
    size = std::min<std::uint32_t>(std::uint32_t{z[0]} + z[1] + z[2], kSizeMax);
    if (around.quiet()) {
      out.put(size == 0 ? 1 : 0, 1);
      if (size != 0) put_node(out, z, 0);
    } else {
      put_node(out, z, around.rice_parameter());
    }
    remember(walk, i, node, size);
  }
  writer = out;
}

bool decode_nodes(const NodeWalk& walk, BitReader& reader, std::int16_t* nodes) {
  check_walk(walk);
  HAIRNET_ASSERT(nodes);
  const std::array<std::uint32_t, 4> weights = size_weights(walk.expectation);
  BitReader in = reader;  // a copy, which stays in registers
  std::uint32_t size = 0;
  for (std::uint32_t i = walk.count; i-- > 0;) {
    std::int16_t* node = nodes + 3 * i;
    const NodeContext around = make_node_context(walk, i, weights, size);
    ZigzagNode z{};
    if (!around.quiet()) {
      z = take_node(in, around.rice_parameter());
    } else if (in.take(1) == 0) {
      z = take_node(in, 0);
    }
    size = std::min<std::uint32_t>(std::uint32_t{z[0]} + z[1] + z[2], kSizeMax);
    for (unsigned axis = 0; axis < 3; ++axis)
      node[axis] = static_cast<std::int16_t>(around.expected[axis] + unzigzag(z[axis]));
    remember(walk, i, node, size);
    if (in.beyond_end()) [[unlikely]]
      return false;
  }
  reader = in;
  return true;
}

}  // namespace hairnet::codec
