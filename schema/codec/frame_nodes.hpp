#pragma once

#include <span>
#include <vector>

#include "schema/codec/code_nodes.hpp"

// The part of the node coding that encoder and decoder share, for a whole frame or for a range of its nodes.
namespace hairnet::codec {

// Encodes or decodes the displacements or the velocities of the nodes: 3 integers each, from the range's first node on.
// Decoding returns false at the end of the bits.
void encode_nodes(const NodeWalk& walk, const std::int16_t* nodes, BitWriter& writer);
[[nodiscard]] bool decode_nodes(const NodeWalk& walk, BitReader& reader, std::int16_t* nodes);

inline constexpr unsigned kVelocityScaleBits = 7;
inline constexpr int kVelocityScaleOne = 16;  // a velocity unit for a step of displacement since the last frame

// An upper bound of the bytes of a node with its velocity.
inline constexpr std::size_t kNodeBytesMax = 2 * (1 + 3 * (kZerosMax + 16)) / 8 + 2;

// The working memory of one range.
struct NodeScratch {
  explicit NodeScratch(NodeRange range) : predicted(3 * range.count), motion(range.count), coded(range.count + 1) {}

  [[nodiscard]] NodeWalk walk(std::span<const NodeNeighbours> neighbours, NodeRange range,
                              const SpatialWeights& spatial, const Expectation& expectation) {
    HAIRNET_ASSERT(std::size_t{range.first} + range.count <= neighbours.size());
    HAIRNET_ASSERT(motion.size() == range.count);  // the range of the constructor
    return {neighbours.subspan(range.first, range.count),
            range.first,
            range.count,
            predicted.data(),
            motion.data(),
            spatial,
            expectation,
            coded.data()};
  }

  std::vector<std::int16_t> predicted;
  std::vector<std::uint16_t> motion;
  std::vector<CodedNode> coded;
};

// Predicts velocities from the displacements since the newest earlier frame, times `scale` / 16.
inline void predict_velocities(const FrameIntegers& frame, History history, NodeRange range, int scale,
                               NodeScratch& scratch) {
  HAIRNET_ASSERT(scratch.predicted.size() == 3 * std::size_t{range.count});
  HAIRNET_ASSERT(frame.nodes.size() >= 3 * (std::size_t{range.first} + range.count));
  HAIRNET_ASSERT(scale >= 0 && scale < 1 << kVelocityScaleBits);
  HAIRNET_ASSERT(history.empty() || history[0]->nodes.size() == frame.nodes.size());
  std::ranges::fill(scratch.motion, std::uint16_t{0});
  const std::size_t begin = 3 * std::size_t{range.first};
  for (std::size_t i = 0; i < scratch.predicted.size(); ++i) {
    const int moved = history.empty() ? 0 : frame.nodes[begin + i] - history[0]->nodes[begin + i];
    scratch.predicted[i] = static_cast<std::int16_t>((moved * scale) >> 4);
  }
}

// Asserts what encode_frame asserts, and that the range lies within the frame. Appends the bones if `with_bones`, and
// the nodes of the range.
void append_content(const FrameIntegers& frame, History history, const Neighbours* neighbours, NodeRange range,
                    bool with_bones, std::vector<std::uint8_t>& out);

}  // namespace hairnet::codec
