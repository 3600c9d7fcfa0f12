#include "core/assert.hpp"
#include "schema/codec/bones.hpp"
#include "schema/codec/frame_nodes.hpp"

namespace hairnet::codec {
namespace {

bool fits(const FrameIntegers& earlier, std::size_t node_count) {
  return earlier.nodes.size() == 3 * node_count;
}

bool decode_plane(std::span<const NodeNeighbours> neighbours, NodeRange range, const Expectation& expectation,
                  NodeScratch& scratch, BitReader& reader, std::int16_t* nodes) {
  const SpatialWeights& spatial = kSpatialWeights[reader.take(kSpatialBits)];
  return decode_nodes(scratch.walk(neighbours, range, spatial, expectation), reader, nodes);
}

bool decode_planes(BitReader& reader, NodeRange range, History history, std::span<const NodeNeighbours> neighbours,
                   bool has_velocities, FrameIntegers& out) {
  // decode_range has checked the arguments that come from outside.
  HAIRNET_ASSERT(history.size() <= kHistoryMax);
  HAIRNET_ASSERT(std::size_t{range.first} + range.count <= neighbours.size());
  HAIRNET_ASSERT(out.velocities.size() == (has_velocities ? out.nodes.size() : 0));
  NodeScratch scratch(range);
  const std::size_t begin = 3 * std::size_t{range.first};
  const TemporalWeights& temporal = kTemporalWeights[history.size()][reader.take(kTemporalBits[history.size()])];
  predict_nodes(history, range, temporal, scratch.predicted, scratch.motion);
  if (!decode_plane(neighbours, range, kDisplacementExpectation[temporal.frames], scratch, reader,
                    out.nodes.data() + begin))
    return false;
  if (!has_velocities) return true;
  const int scale = history.empty() ? 0 : static_cast<int>(reader.take(kVelocityScaleBits));
  predict_velocities(out, history, range, scale, scratch);
  return decode_plane(neighbours, range, kVelocityExpectation, scratch, reader, out.velocities.data() + begin);
}

}  // namespace

bool decode_range(std::span<const std::uint8_t> bytes, NodeRange range, bool with_bones, History history,
                  const Neighbours* neighbours, bool has_velocities, FrameIntegers& out) {
  const std::size_t node_count = neighbours ? neighbours->node_count() : 0;
  if (history.size() > kHistoryMax || !fits(out, node_count)) return false;
  for (const FrameIntegers* earlier : history) {
    if (!earlier || !fits(*earlier, node_count)) return false;
  }
  if (range.first > node_count || range.count > node_count - range.first) return false;
  out.velocities.resize(has_velocities ? out.nodes.size() : 0);
  BitReader reader(bytes);
  if (with_bones) decode_bones(reader, history, out);
  if (range.count > 0 && !decode_planes(reader, range, history, NeighbourAccess::of(*neighbours), has_velocities, out))
    return false;
  return reader.ends_here();
}

bool decode_frame(std::span<const std::uint8_t> bytes, History history, const Neighbours* neighbours,
                  bool has_velocities, FrameIntegers& out) {
  const std::size_t node_count = neighbours ? neighbours->node_count() : 0;
  out.nodes.resize(3 * node_count);
  return decode_range(bytes, {0, static_cast<std::uint32_t>(node_count)}, true, history, neighbours, has_velocities,
                      out);
}

}  // namespace hairnet::codec
