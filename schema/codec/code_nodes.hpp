#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>

#include "schema/codec/golomb.hpp"
#include "schema/codec/neighbours.hpp"
#include "schema/codec/node_bits.hpp"
#include "schema/codec/temporal.hpp"

// The walk over nodes that encoder and decoder share. It goes from the last node to the first. The errors of a node's
// neighbours correct its prediction, and the neighbours' sizes determine its Rice parameter.
namespace hairnet::codec {

// The share of the neighbours' errors that corrects a node's prediction, in 32nds of their sum, by the number of
// neighbours. A frame chooses it.
using SpatialWeights = std::array<std::int32_t, 4>;
inline constexpr unsigned kSpatialBits = 2;
inline constexpr std::array<SpatialWeights, 1 << kSpatialBits> kSpatialWeights{
    {{0, 0, 0, 0}, {0, 12, 7, 4}, {0, 22, 12, 8}, {0, 33, 17, 11}}};

// The expected size of a node's integers, as weights of the neighbours' mean size and of the node's motion.
struct Expectation {
  std::uint32_t neighbours, motion;
};
inline constexpr unsigned kExpectationShift = 10;
// Indexed by the number of frames that the prediction uses.
inline constexpr std::array<Expectation, kHistoryMax + 1> kDisplacementExpectation{
    {{72, 0}, {70, 0}, {52, 60}, {40, 150}}};
inline constexpr Expectation kVelocityExpectation{72, 0};

// The data of a coded node that later nodes need.
struct CodedNode {
  std::array<std::int16_t, 3> error;  // node minus temporal prediction
  std::uint16_t size;                 // sum of the three zigzag integers; at most kSizeMax
};
inline constexpr unsigned kSizeMax = 16383;

// The largest expected size, of a node whose neighbours' sizes and motion are the largest.
constexpr std::uint32_t expected_size_max(const Expectation& expectation) {
  return (6 * expectation.neighbours * kSizeMax + expectation.motion * kMotionMax) >> kExpectationShift;
}
static_assert(std::ranges::all_of(kDisplacementExpectation, [](const Expectation& e) {
  return std::bit_width(expected_size_max(e) | 1) - 1 <= kRiceParameterMax;
}));
static_assert(std::bit_width(expected_size_max(kVelocityExpectation) | 1) - 1 <= kRiceParameterMax);

// The data of the walk, without the bits.
struct NodeWalk {
  std::span<const NodeNeighbours> neighbours;  // of the range's nodes
  std::uint32_t first, count;                  // the range
  const std::int16_t* predicted;               // 3 a node, from the range's first node on
  const std::uint16_t* motion;                 // 1 a node
  SpatialWeights spatial;
  Expectation expectation;
  CodedNode* coded;  // one more than nodes: absent neighbours refer to the last entry, which is zero
};

// The surroundings of a node to be coded.
struct NodeContext {
  std::array<std::int16_t, 3> expected;
  std::uint32_t expected_size;

  [[nodiscard]] bool quiet() const { return expected_size == 0; }
  [[nodiscard]] unsigned rice_parameter() const { return static_cast<unsigned>(std::bit_width(expected_size | 1)) - 1; }
};

// Asserts that the arrays of a walk have the sizes that its range needs.
inline void check_walk(const NodeWalk& walk) {
  HAIRNET_ASSERT(walk.neighbours.size() == walk.count);
  HAIRNET_ASSERT(walk.predicted && walk.motion && walk.coded);
  HAIRNET_ASSERT(walk.coded[walk.count].size == 0);  // absent neighbours
}

// `last_size`: of the node coded before, used when there is no neighbour.
inline NodeContext make_node_context(const NodeWalk& walk, std::uint32_t i,
                                     const std::array<std::uint32_t, 4>& size_weights, std::uint32_t last_size) {
  const NodeNeighbours& neighbours = walk.neighbours[i];
  const std::uint32_t a = std::min(neighbours[0] - walk.first, walk.count);
  const std::uint32_t b = std::min(neighbours[1] - walk.first, walk.count);
  const std::uint32_t c = std::min(neighbours[2] - walk.first, walk.count);
  const unsigned count = unsigned{a < walk.count} + unsigned{b < walk.count} + unsigned{c < walk.count};
  const CodedNode &na = walk.coded[a], &nb = walk.coded[b], &nc = walk.coded[c];
  const std::uint32_t sizes = count == 0 ? last_size : std::uint32_t{na.size} + nb.size + nc.size;
  NodeContext out;
  out.expected_size = (sizes * size_weights[count] + walk.motion[i] * walk.expectation.motion) >> kExpectationShift;
  const std::int32_t weight = walk.spatial[count];
  for (unsigned axis = 0; axis < 3; ++axis) {
    const std::int32_t errors = na.error[axis] + nb.error[axis] + nc.error[axis];
    out.expected[axis] = static_cast<std::int16_t>(walk.predicted[3 * i + axis] + ((weight * errors + 16) >> 5));
  }
  return out;
}

// Weights for a sum over that many neighbours, which give the mean.
inline std::array<std::uint32_t, 4> size_weights(const Expectation& expectation) {
  const std::uint32_t one = expectation.neighbours;
  return {6 * one, 6 * one, 3 * one, 2 * one};
}

inline void remember(const NodeWalk& walk, std::uint32_t i, const std::int16_t* node, std::uint32_t size) {
  HAIRNET_VALIDATE(size <= kSizeMax);
  CodedNode& coded = walk.coded[i];
  for (unsigned axis = 0; axis < 3; ++axis)
    coded.error[axis] = static_cast<std::int16_t>(node[axis] - walk.predicted[3 * i + axis]);
  coded.size = static_cast<std::uint16_t>(size);
}

}  // namespace hairnet::codec
