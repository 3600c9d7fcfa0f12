#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>

#include "schema/codec/golomb.hpp"
#include "schema/codec/neighbours.hpp"
#include "schema/codec/temporal.hpp"

// The walk over a frame's nodes that encoder and decoder share: from the last node to the first, each three Rice codes
// of what the prediction leaves.
namespace hairnet::codec {

// Share of the neighbours' errors that a node's prediction is corrected by, in 32nds of their sum: by how many
// neighbours there are. A frame chooses.
struct SpatialWeights {
  std::array<int, 4> per_neighbour;
};
inline constexpr unsigned kSpatialBits = 2;
inline constexpr std::array<SpatialWeights, 1 << kSpatialBits> kSpatialWeights{
    {{{0, 0, 0, 0}}, {{0, 12, 7, 4}}, {{0, 22, 12, 8}}, {{0, 33, 17, 11}}}};

// How large a node's three codes will be: from the neighbours' codes and the node's motion.
struct Expectation {
  std::uint32_t neighbours, motion;  // weights
};
inline constexpr unsigned kExpectationShift = 9;

inline constexpr int kSizeMax = 8191;

// What is known of a coded node.
struct CodedNode {
  std::array<std::int16_t, 3> error{};  // of the prediction without its neighbours
  std::uint16_t size = 0;               // of what was sent: the three codes' absolute values together, at most kSizeMax
};

class EncodeNode {
 public:
  explicit EncodeNode(BitWriter& writer) : writer_(writer) {}
  // `residual`: what is to be sent.
  bool operator()(bool quiet, unsigned k, const std::array<std::int16_t, 3>& expected, const std::int16_t* node,
                  std::array<std::int16_t, 3>& residual) {
    for (unsigned axis = 0; axis < 3; ++axis) residual[axis] = static_cast<std::int16_t>(node[axis] - expected[axis]);
    if (quiet) {
      const bool still = (residual[0] | residual[1] | residual[2]) == 0;
      writer_.put(still ? 1 : 0, 1);
      if (still) return true;
    }
    for (unsigned axis = 0; axis < 3; ++axis) put_rice(writer_, fold(residual[axis]), k);
    return true;
  }

 private:
  BitWriter& writer_;
};

class DecodeNode {
 public:
  explicit DecodeNode(BitReader& reader) : reader_(reader) {}
  bool operator()(bool quiet, unsigned k, const std::array<std::int16_t, 3>& expected, std::int16_t* node,
                  std::array<std::int16_t, 3>& residual) {
    std::uint64_t word = reader_.peek();
    if (quiet) {
      reader_.skip(1);
      if (word & 1) {
        residual = {};
        for (unsigned axis = 0; axis < 3; ++axis) node[axis] = expected[axis];
        return true;
      }
      word = reader_.peek();
    }
    for (unsigned axis = 0; axis < 3; ++axis) {
      unsigned length = 0;
      residual[axis] = unfold(rice_at(word, k, length));
      reader_.skip(length);
      word = reader_.peek();
      node[axis] = static_cast<std::int16_t>(expected[axis] + residual[axis]);
    }
    return !reader_.beyond_end();
  }

 private:
  BitReader& reader_;
};

// Codes `range` of `nodes` (3 each; the pointers are to the range's first), with what history predicts. False when
// there are no more bits to decode.
template <class CodeNode, class Node>
bool code_nodes(std::span<const NodeNeighbours> neighbours, NodeRange range, const std::int16_t* predicted,
                const std::uint16_t* motion, const SpatialWeights& spatial, const Expectation& expectation,
                std::span<CodedNode> coded, CodeNode code, Node* nodes) {
  static constexpr std::array<std::uint32_t, 4> kSixthsOfMean{0, 6, 3, 2};
  CodedNode last;
  for (std::uint32_t i = range.count; i-- > 0;) {
    std::array<int, 3> errors{};
    std::uint32_t sizes = 0;
    unsigned count = 0;
    for (const std::uint32_t neighbour : neighbours[range.first + i]) {
      const std::uint32_t at = neighbour - range.first;  // huge when absent
      if (at >= range.count) break;
      const CodedNode& known = coded[at];
      for (unsigned axis = 0; axis < 3; ++axis) errors[axis] += known.error[axis];
      sizes += known.size;
      ++count;
    }
    const std::uint32_t size6 = count == 0 ? 6u * last.size : sizes * kSixthsOfMean[count];
    const std::uint32_t expected_size =
        (size6 * expectation.neighbours + motion[i] * expectation.motion) >> kExpectationShift;
    const int weight = spatial.per_neighbour[count];
    std::array<std::int16_t, 3> expected, residual;
    for (unsigned axis = 0; axis < 3; ++axis)
      expected[axis] = static_cast<std::int16_t>(predicted[3 * i + axis] + ((weight * errors[axis] + 16) >> 5));
    const auto k = static_cast<unsigned>(std::bit_width(expected_size >> 1));
    if (!code(expected_size == 0, k, expected, nodes + 3 * i, residual)) return false;
    for (unsigned axis = 0; axis < 3; ++axis)
      last.error[axis] = static_cast<std::int16_t>(nodes[3 * i + axis] - predicted[3 * i + axis]);
    last.size = static_cast<std::uint16_t>(
        std::min(std::abs(residual[0]) + std::abs(residual[1]) + std::abs(residual[2]), kSizeMax));
    coded[i] = last;
  }
  return true;
}

}  // namespace hairnet::codec
