#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "schema/codec/bits.hpp"

// The bits of a node: three zigzag integers z, Rice coded with one parameter k. First z >> k zeros and a one for each,
// then the low k bits of each. An integer with kZerosMax zeros or more has exactly kZerosMax zeros and no one, and all
// its 16 bits later. All zeros come first so that a decoder can count them before it knows k.
namespace hairnet::codec {

using ZigzagNode = std::array<std::uint16_t, 3>;

inline constexpr unsigned kZerosMax = 16;
inline constexpr unsigned kRiceParameterMax = 15;
inline constexpr unsigned kPeekBits = 57;  // BitReader::peek returns at least this many
static_assert(3 * (kZerosMax + 1) <= kPeekBits && 3 * kRiceParameterMax <= kPeekBits);

// For nodes with an integer with too many zeros, or with too many bits for one word.
void put_long_node(BitWriter& writer, const ZigzagNode& z, unsigned k);
ZigzagNode take_long_node(BitReader& reader, unsigned k);

inline void put_node(BitWriter& writer, const ZigzagNode& z, unsigned k) {
  HAIRNET_VALIDATE(k <= kRiceParameterMax);
  const unsigned a = z[0] >> k, b = z[1] >> k, c = z[2] >> k;
  const unsigned zeros_bits = a + b + c + 3;
  // kZerosMax is a power of 2, so the OR shows a value that large
  if (zeros_bits + 3 * k > 56 || (a | b | c) >= kZerosMax) [[unlikely]]
    return put_long_node(writer, z, k);
  const std::uint64_t one = 1, mask = (one << k) - 1;
  const std::uint64_t ones = one << a | one << (a + b + 1) | one << (zeros_bits - 1);
  const std::uint64_t low = (z[0] & mask) | (z[1] & mask) << k | (z[2] & mask) << 2 * k;
  writer.put(ones | low << zeros_bits, zeros_bits + 3 * k);
}

inline ZigzagNode take_node(BitReader& reader, unsigned k) {
  HAIRNET_VALIDATE(k <= kRiceParameterMax);
  const std::uint64_t word = reader.peek();
  std::uint64_t rest = word;
  const auto a = static_cast<unsigned>(std::countr_zero(rest));
  rest &= rest - 1;
  const auto b = static_cast<unsigned>(std::countr_zero(rest));
  rest &= rest - 1;
  const auto c = static_cast<unsigned>(std::countr_zero(rest));  // 64 when there is none, which is too many
  const unsigned zeros_bits = c + 1;
  const unsigned zeros_a = a, zeros_b = b - a - 1, zeros_c = c - b - 1;
  if (zeros_bits + 3 * k > kPeekBits || (zeros_a | zeros_b | zeros_c) >= kZerosMax) [[unlikely]]
    return take_long_node(reader, k);
  reader.skip(zeros_bits + 3 * k);
  const std::uint64_t mask = (std::uint64_t{1} << k) - 1;
  const std::uint64_t low = word >> zeros_bits;
  return {static_cast<std::uint16_t>(zeros_a << k | (low & mask)),
          static_cast<std::uint16_t>(zeros_b << k | (low >> k & mask)),
          static_cast<std::uint16_t>(zeros_c << k | (low >> 2 * k & mask))};
}

}  // namespace hairnet::codec
