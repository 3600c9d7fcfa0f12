#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

#include "schema/codec/bits.hpp"

// Signed integers as bits: small numbers take few bits, and the length is bounded.
namespace hairnet::codec {

// Maps 0, -1, 1, -2, ... to 0, 1, 2, 3, ..., so that small numbers of either sign become small. All arithmetic is
// modulo 2^16 or 2^32.
inline std::uint16_t zigzag(std::int16_t x) {
  return static_cast<std::uint16_t>((x << 1) ^ (x >> 15));
}
inline std::int16_t unzigzag(std::uint16_t z) {
  return static_cast<std::int16_t>((z >> 1) ^ -(z & 1));
}
inline std::uint32_t zigzag(std::int32_t x) {
  return (static_cast<std::uint32_t>(x) << 1) ^ static_cast<std::uint32_t>(x >> 31);
}
inline std::int32_t unzigzag(std::uint32_t z) {
  return static_cast<std::int32_t>((z >> 1) ^ (0u - (z & 1)));
}

// Exponential Golomb: with y = z + 2^k, first one zero for each bit of y beyond k + 1, then a one, then y without its
// highest bit. For 32-bit z and k < 32; at most 32 - k zeros.
inline void put_exponential(BitWriter& writer, std::uint32_t z, unsigned k) {
  HAIRNET_VALIDATE(k < 32);
  const std::uint64_t y = std::uint64_t{z} + (std::uint64_t{1} << k);
  const auto low_bits = static_cast<unsigned>(std::bit_width(y)) - 1;
  writer.put(std::uint64_t{1} << (low_bits - k), low_bits - k + 1);
  writer.put(y & ((std::uint64_t{1} << low_bits) - 1), low_bits);
}

inline std::uint32_t take_exponential(BitReader& reader, unsigned k) {
  HAIRNET_VALIDATE(k < 32);
  // The set bit 55 and the minimum bound the zeros, so that any bits are a valid number.
  const auto zeros = std::min(static_cast<unsigned>(std::countr_zero(reader.peek() | std::uint64_t{1} << 55)), 32 - k);
  reader.skip(zeros + 1);
  const unsigned low_bits = zeros + k;
  const std::uint64_t y = reader.take(low_bits) | std::uint64_t{1} << low_bits;
  return static_cast<std::uint32_t>(y - (std::uint64_t{1} << k));
}

}  // namespace hairnet::codec
