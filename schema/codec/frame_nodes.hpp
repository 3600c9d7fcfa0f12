#pragma once

#include <span>

#include "schema/codec/code_nodes.hpp"

// The node part of a frame or of a range of one, the same for both ends but for who says the choices.
namespace hairnet::codec {

// By the number of frames that the prediction uses.
inline constexpr std::array<Expectation, kHistoryMax + 1> kDisplacementExpectation{
    {{72, 0}, {70, 0}, {52, 30}, {40, 75}}};
inline constexpr Expectation kVelocityExpectation{72, 0};

inline constexpr unsigned kVelocityScaleBits = 7;
inline constexpr int kVelocityScaleOne = 16;  // a velocity unit a step of displacement since the last frame

// More than a node, or a node with its velocity, can take.
inline constexpr std::size_t kNodeBytesMax = 2 * (3 * kRiceBitsMax + 1) / 8 + 2;

// Scratch of one frame.
struct NodeScratch {
  explicit NodeScratch(std::size_t count) : predicted(3 * count), motion(count), coded(count) {}
  std::vector<std::int16_t> predicted;
  std::vector<std::uint16_t> motion;
  std::vector<CodedNode> coded;
};

// Into the scratch: velocities that the displacements since the newest earlier frame speak of, at `scale` sixteenths.
inline void predict_velocities(const Integers& frame, History history, NodeRange range, int scale,
                               NodeScratch& scratch) {
  std::ranges::fill(scratch.motion, std::uint16_t{0});
  const std::size_t begin = 3 * std::size_t{range.first};
  for (std::size_t i = 0; i < scratch.predicted.size(); ++i) {
    const int moved = history.empty() ? 0 : frame.nodes[begin + i] - history[0]->nodes[begin + i];
    scratch.predicted[i] = static_cast<std::int16_t>((moved * scale) >> 4);
  }
}

// The bones if `with_bones`, and the nodes of the range: appended.
void append_content(const Integers& frame, History history, const Neighbours* neighbours, NodeRange range,
                    bool with_bones, std::vector<std::uint8_t>& out);

}  // namespace hairnet::codec
