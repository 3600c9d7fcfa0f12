#include "core/solver/kernels.hpp"

#include "core/assert.hpp"

// foreach_target.h compiles this file once more for each instruction set, and with it step_inl.hpp and what it
// includes. Code up to HWY_ONCE therefore calls nothing that other files compile for one set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/solver/kernels.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

#include "core/solver/step_inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace hairnet {
namespace HWY_NAMESPACE {

using CrowdLanes = Crowd<hn::CappedTag<float, 16>>;

template <class Lanes>
constexpr LaneSizes sizes_of() {
  return {Lanes::kReal, Lanes::kVector, Lanes::kBlock};
}
LaneSizes crowd_sizes_here() {
  return sizes_of<CrowdLanes>();
}
LaneSizes single_sizes_here() {
  return sizes_of<Single>();
}

void crowd_kernel_here(const LevelView& level, const LaneMemory& memory, int iterations) {
  Step<CrowdLanes>(level, memory).run(iterations);
}
void single_kernel_here(const LevelView& level, const LaneMemory& memory, int iterations) {
  Step<Single>(level, memory).run(iterations);
}

#if HWY_TARGET == HWY_SCALAR
constexpr std::size_t kTile = 1;
#else
// Characters move to lanes and back in squares of four numbers of four characters, which four registers transpose
// without going through memory.
constexpr std::size_t kTile = 4;
// Swaps rows[r][c] and rows[c][r].
template <class V>
HWY_INLINE void transpose(V (&rows)[4]) {
  const hn::FixedTag<float, 4> d;
  const hn::Repartition<double, decltype(d)> pairs;
  const V low_01 = hn::InterleaveLower(d, rows[0], rows[1]), high_01 = hn::InterleaveUpper(d, rows[0], rows[1]);
  const V low_23 = hn::InterleaveLower(d, rows[2], rows[3]), high_23 = hn::InterleaveUpper(d, rows[2], rows[3]);
  const auto as_pairs = [&](V v) HWY_ATTR { return hn::BitCast(pairs, v); };
  rows[0] = hn::BitCast(d, hn::InterleaveLower(pairs, as_pairs(low_01), as_pairs(low_23)));
  rows[1] = hn::BitCast(d, hn::InterleaveUpper(pairs, as_pairs(low_01), as_pairs(low_23)));
  rows[2] = hn::BitCast(d, hn::InterleaveLower(pairs, as_pairs(high_01), as_pairs(high_23)));
  rows[3] = hn::BitCast(d, hn::InterleaveUpper(pairs, as_pairs(high_01), as_pairs(high_23)));
}
#endif

constexpr std::size_t kLaneCount = CrowdLanes::kReal;
static_assert(kLaneCount % kTile == 0, "characters move to lanes in whole tiles");

void to_lanes_here(const float* const* characters, std::size_t character_count, std::size_t float_count, float* lanes) {
  std::size_t f = 0;
#if HWY_TARGET != HWY_SCALAR
  const hn::FixedTag<float, 4> d;
  for (; f + kTile <= float_count; f += kTile) {
    for (std::size_t l = 0; l < kLaneCount; l += kTile) {
      hn::Vec<decltype(d)> rows[kTile];
      for (std::size_t t = 0; t < kTile; ++t) {
        // The characters' own arrays have no padding, so they need not be aligned; the lanes are.
        rows[t] = l + t < character_count ? hn::LoadU(d, characters[l + t] + f) : hn::Zero(d);
      }
      transpose(rows);
      for (std::size_t t = 0; t < kTile; ++t) hn::Store(rows[t], d, lanes + (f + t) * kLaneCount + l);
    }
  }
#endif
  // The numbers after the last whole tile, at most three of each character.
  for (; f < float_count; ++f) {
    for (std::size_t l = 0; l < kLaneCount; ++l) {
      lanes[f * kLaneCount + l] = l < character_count ? characters[l][f] : 0;
    }
  }
}

void from_lanes_here(const float* lanes, std::size_t float_count, float* const* characters,
                     std::size_t character_count) {
  std::size_t f = 0;
#if HWY_TARGET != HWY_SCALAR
  const hn::FixedTag<float, 4> d;
  for (; f + kTile <= float_count; f += kTile) {
    for (std::size_t l = 0; l < kLaneCount; l += kTile) {
      hn::Vec<decltype(d)> rows[kTile];
      for (std::size_t t = 0; t < kTile; ++t) rows[t] = hn::Load(d, lanes + (f + t) * kLaneCount + l);
      transpose(rows);
      for (std::size_t t = 0; t < kTile && l + t < character_count; ++t) hn::StoreU(rows[t], d, characters[l + t] + f);
    }
  }
#endif
  for (; f < float_count; ++f) {
    for (std::size_t l = 0; l < character_count; ++l) characters[l][f] = lanes[f * kLaneCount + l];
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace hairnet
HWY_AFTER_NAMESPACE();

// Compiled a single time: each entry picks the best instruction set of the machine at the first call.
#if HWY_ONCE
namespace hairnet {
namespace {
HWY_EXPORT(crowd_sizes_here);
HWY_EXPORT(single_sizes_here);
HWY_EXPORT(crowd_kernel_here);
HWY_EXPORT(single_kernel_here);
HWY_EXPORT(to_lanes_here);
HWY_EXPORT(from_lanes_here);

void check_kernel_input(const LevelView& level, const LaneMemory& memory, int iterations) {
  HAIRNET_ASSERT(memory.terms);
  HAIRNET_ASSERT(iterations >= 0);
  HAIRNET_ASSERT(level.springs.count == 0 || level.springs.rest_length);
  HAIRNET_ASSERT(level.skin_count == 0 || level.skin);
}
}  // namespace

LaneSizes crowd_sizes() {
  return HWY_DYNAMIC_DISPATCH(crowd_sizes_here)();
}
LaneSizes single_sizes() {
  return HWY_DYNAMIC_DISPATCH(single_sizes_here)();
}
void crowd_kernel(const LevelView& level, const LaneMemory& memory, int iterations) {
  // A crowd's nodes collect their pulls by these lists.
  HAIRNET_ASSERT(level.incidences.begin);
  check_kernel_input(level, memory, iterations);
  HWY_DYNAMIC_DISPATCH(crowd_kernel_here)(level, memory, iterations);
}
void single_kernel(const LevelView& level, const LaneMemory& memory, int iterations) {
  check_kernel_input(level, memory, iterations);
  HWY_DYNAMIC_DISPATCH(single_kernel_here)(level, memory, iterations);
}
void to_lanes(const float* const* characters, std::size_t character_count, std::size_t float_count, float* lanes) {
  HAIRNET_ASSERT(character_count <= crowd_sizes().real);
  for (std::size_t c = 0; c < character_count; ++c) HAIRNET_ASSERT(characters[c] || float_count == 0);
  HWY_DYNAMIC_DISPATCH(to_lanes_here)(characters, character_count, float_count, lanes);
}
void from_lanes(const float* lanes, std::size_t float_count, float* const* characters, std::size_t character_count) {
  HAIRNET_ASSERT(character_count <= crowd_sizes().real);
  for (std::size_t c = 0; c < character_count; ++c) HAIRNET_ASSERT(characters[c] || float_count == 0);
  HWY_DYNAMIC_DISPATCH(from_lanes_here)(lanes, float_count, characters, character_count);
}

}  // namespace hairnet
#endif
