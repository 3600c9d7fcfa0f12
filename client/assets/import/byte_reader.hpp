#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/geometry/vec.hpp"

namespace hairnet {

// A number of 16 bits: a sign, an exponent of 5 bits and a fraction of 10. With the exponent 0 numbers are denormal, f
// 2^-24; with 31 they are infinite or no numbers. All others are (1024 + f) 2^(e - 25), for the fraction f and the
// exponent e.
inline float half_float(std::uint16_t bits) {
  const int exponent = (bits >> 10) & 31, fraction = bits & 1023;
  float size = std::ldexp(static_cast<float>(fraction), -24);
  if (exponent > 0) size = std::ldexp(static_cast<float>(1024 + fraction), exponent - 25);
  if (exponent == 31) size = fraction == 0 ? HUGE_VALF : NAN;
  return (bits & 0x8000) != 0 ? -size : size;
}

// Reads little-endian values at any alignment. The reads do not check the size: call `has` first. Unchecked reads let a
// decoder check a whole table by one comparison. A read beyond the end is undefined.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes, std::size_t at = 0) : bytes_(bytes), at_(at) {}

  [[nodiscard]] std::size_t at() const { return at_; }
  [[nodiscard]] std::size_t remaining() const { return bytes_.size() - at_; }
  [[nodiscard]] bool has(std::size_t bytes) const { return bytes <= remaining(); }
  // Whether `count` items of `item_bytes` are left; the check cannot overflow. A product of both could wrap around to a
  // small number, and a false count would then pass.
  [[nodiscard]] bool has(std::uint64_t count, std::size_t item_bytes) const {
    return count <= remaining() / item_bytes;
  }

  void skip(std::size_t bytes) { at_ += bytes; }
  std::uint8_t u8() { return static_cast<std::uint8_t>(little_endian(1)); }
  std::uint16_t u16() { return static_cast<std::uint16_t>(little_endian(2)); }
  std::uint32_t u32() { return little_endian(4); }
  std::uint64_t u64() {
    const std::uint64_t low = u32();
    return low | std::uint64_t{u32()} << 32;
  }
  float f32() { return std::bit_cast<float>(u32()); }
  double f64() { return std::bit_cast<double>(u64()); }
  Vec3f vec3f() {
    const float x = f32(), y = f32(), z = f32();
    return {x, y, z};
  }

 private:
  std::uint32_t little_endian(std::size_t bytes) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) value |= std::to_integer<std::uint32_t>(bytes_[at_ + i]) << (8 * i);
    at_ += bytes;
    return value;
  }

  std::span<const std::byte> bytes_;
  // The place of the next read, in bytes from the begin of `bytes_`.
  std::size_t at_;
};

}  // namespace hairnet
