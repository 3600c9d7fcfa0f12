#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "schema/codec/frame_codec.hpp"

// Predicts a coordinate from its values a, b, c in the frames at t-s, t-2s, t-3s: a plus weighted first (a - b) and
// second (a - 2b + c) differences. The best weights differ between motions, so each frame states its own.
namespace hairnet::codec {

struct TemporalWeights {
  std::uint8_t frames;         // number of earlier frames used; 0: the prediction is 0
  std::int16_t first, second;  // eighths
};
// The weights that a frame can choose from, by order, and the number of bits for the choice.
inline constexpr std::array<unsigned, kHistoryMax + 1> kTemporalBits{0, 1, 3, 4};
inline constexpr std::array<std::array<TemporalWeights, 16>, kHistoryMax + 1> kTemporalWeights{{
    {{{0, 0, 0}}},
    {{{1, 0, 0}, {0, 0, 0}}},
    {{{2, 8, 0}, {2, 7, 0}, {2, 6, 0}, {2, 5, 0}, {2, 4, 0}, {2, 2, 0}, {1, 0, 0}, {0, 0, 0}}},
    {{{3, 8, 8},
      {3, 8, 6},
      {3, 8, 4},
      {3, 8, 0},
      {3, 7, 8},
      {3, 7, 6},
      {3, 7, 4},
      {3, 6, 8},
      {3, 6, 6},
      {3, 6, 4},
      {3, 6, 2},
      {3, 5, 6},
      {3, 5, 4},
      {2, 4, 0},
      {1, 0, 0},
      {0, 0, 0}}},
}};

// A choice of an order uses at most as many frames as there are.
static_assert([] {
  for (std::size_t order = 0; order <= kHistoryMax; ++order) {
    for (std::size_t choice = 0; choice < std::size_t{1} << kTemporalBits[order]; ++choice) {
      if (kTemporalWeights[order][choice].frames > order) return false;
    }
  }
  return true;
}());

// Predicts from the frames that the weights use, modulo 2^16. `motion` is the size of the highest difference in the
// history (0 for orders 0 and 1), summed over a node's three coordinates, at most kMotionMax. Where it is large, the
// expected error is large.
inline constexpr int kMotionMax = 8191;
void predict_nodes(History history, NodeRange range, TemporalWeights weights, std::span<std::int16_t> predicted,
                   std::span<std::uint16_t> motion);

// The index of the weights that fit the range best, estimated from a sample of its nodes.
unsigned choose_temporal(const FrameIntegers& frame, History history, NodeRange range);

}  // namespace hairnet::codec
