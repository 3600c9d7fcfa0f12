#include <memory>

#include "core/assert.hpp"
#include "schema/codec/bones.hpp"
#include "schema/codec/frame_nodes.hpp"

namespace hairnet::codec {
namespace {

// The spatial weights that leave the smallest errors, estimated on some of the nodes.
unsigned choose_spatial(std::span<const NodeNeighbours> neighbours, NodeRange range, const std::int16_t* nodes,
                        const std::int16_t* predicted) {
  HAIRNET_ASSERT(std::size_t{range.first} + range.count <= neighbours.size());
  constexpr std::uint32_t kSamplesMax = 32;
  const std::uint32_t stride = range.count / kSamplesMax + 1;
  std::array<std::uint32_t, kSpatialWeights.size()> sums{};
  const auto error = [&](std::uint32_t i, unsigned axis) {
    return static_cast<std::int16_t>(nodes[3 * i + axis] - predicted[3 * i + axis]);
  };
  for (std::uint32_t i = 0; i < range.count; i += stride) {
    std::array<std::int32_t, 3> known{};
    unsigned count = 0;
    for (const std::uint32_t neighbour : neighbours[range.first + i]) {
      const std::uint32_t at = neighbour - range.first;
      if (at >= range.count) break;
      for (unsigned axis = 0; axis < 3; ++axis) known[axis] += error(at, axis);
      ++count;
    }
    for (unsigned axis = 0; axis < 3; ++axis) {
      const std::int32_t own = error(i, axis);
      for (std::size_t choice = 0; choice < sums.size(); ++choice) {
        const std::int32_t left = own - ((kSpatialWeights[choice][count] * known[axis] + 16) >> 5);
        sums[choice] += static_cast<std::uint32_t>(left < 0 ? -left : left);
      }
    }
  }
  return static_cast<unsigned>(std::ranges::min_element(sums) - sums.begin());
}

// The scale for which displacements predict velocities best, by least squares.
int choose_velocity_scale(const FrameIntegers& frame, std::span<const std::int16_t> before, NodeRange range) {
  HAIRNET_ASSERT(before.size() == frame.nodes.size());
  HAIRNET_ASSERT(frame.velocities.size() == frame.nodes.size());
  std::int64_t product = 0, square = 0;
  for (std::size_t i = 3 * std::size_t{range.first}; i < 3 * (std::size_t{range.first} + range.count); ++i) {
    const int moved = frame.nodes[i] - before[i];
    product += std::int64_t{moved} * frame.velocities[i];
    square += std::int64_t{moved} * moved;
  }
  if (square == 0 || product <= 0) return 0;
  return static_cast<int>(
      std::min<std::int64_t>((kVelocityScaleOne * product + square / 2) / square, (1 << kVelocityScaleBits) - 1));
}

void encode_plane(std::span<const NodeNeighbours> neighbours, NodeRange range, const Expectation& expectation,
                  const std::int16_t* nodes, NodeScratch& scratch, BitWriter& writer) {
  const unsigned spatial = choose_spatial(neighbours, range, nodes, scratch.predicted.data());
  writer.put(spatial, kSpatialBits);
  encode_nodes(scratch.walk(neighbours, range, kSpatialWeights[spatial], expectation), nodes, writer);
}

void encode_planes(const FrameIntegers& frame, History history, std::span<const NodeNeighbours> neighbours,
                   NodeRange range, BitWriter& writer) {
  NodeScratch scratch(range);
  const std::size_t begin = 3 * std::size_t{range.first};
  const unsigned choice = choose_temporal(frame, history, range);
  writer.put(choice, kTemporalBits[history.size()]);
  const TemporalWeights& temporal = kTemporalWeights[history.size()][choice];
  predict_nodes(history, range, temporal, scratch.predicted, scratch.motion);
  encode_plane(neighbours, range, kDisplacementExpectation[temporal.frames], frame.nodes.data() + begin, scratch,
               writer);
  if (frame.velocities.empty()) return;
  int scale = 0;
  if (!history.empty()) {
    scale = choose_velocity_scale(frame, history[0]->nodes, range);
    writer.put(static_cast<std::uint64_t>(scale), kVelocityScaleBits);
  }
  predict_velocities(frame, history, range, scale, scratch);
  encode_plane(neighbours, range, kVelocityExpectation, frame.velocities.data() + begin, scratch, writer);
}

}  // namespace

void append_content(const FrameIntegers& frame, History history, const Neighbours* neighbours, NodeRange range,
                    bool with_bones, std::vector<std::uint8_t>& out) {
  HAIRNET_ASSERT(history.size() <= kHistoryMax);
  HAIRNET_ASSERT(frame.nodes.size() == (neighbours ? 3 * neighbours->node_count() : 0));
  for (const FrameIntegers* earlier : history) {
    HAIRNET_ASSERT(earlier);
    HAIRNET_ASSERT(earlier->nodes.size() == frame.nodes.size());
  }
  HAIRNET_ASSERT(range.first <= frame.nodes.size() / 3);
  HAIRNET_ASSERT(range.count <= frame.nodes.size() / 3 - range.first);
  HAIRNET_ASSERT(frame.velocities.empty() || frame.velocities.size() == frame.nodes.size());
  // Reserves the worst case; most of this memory is never touched.
  const std::size_t bytes_max = kBonesBytesMax + kNodeBytesMax * range.count + kWriterSlackBytes;
  const std::unique_ptr<std::uint8_t[]> room = std::make_unique_for_overwrite<std::uint8_t[]>(bytes_max);
  BitWriter writer(room.get());
  if (with_bones) encode_bones(frame, history, writer);
  if (range.count > 0) encode_planes(frame, history, NeighbourAccess::of(*neighbours), range, writer);
  const std::size_t byte_count = writer.finish();
  HAIRNET_ASSERT(byte_count + kWriterSlackBytes <= bytes_max);
  out.insert(out.end(), room.get(), room.get() + byte_count);
}

void encode_frame(const FrameIntegers& frame, History history, const Neighbours* neighbours,
                  std::vector<std::uint8_t>& out) {
  const NodeRange all{0, static_cast<std::uint32_t>(frame.nodes.size() / 3)};
  append_content(frame, history, neighbours, all, true, out);
}

}  // namespace hairnet::codec
