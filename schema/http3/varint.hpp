#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hairnet::http3 {

using Bytes = std::vector<std::uint8_t>;

// The largest integer that QUIC's variable-length form has (RFC 9000, section 16).
inline constexpr std::uint64_t kVarintMax = (std::uint64_t{1} << 62) - 1;
inline constexpr std::size_t kVarintBytesMax = 8;

struct Varint {
  std::uint64_t value = 0;
  // How many bytes the integer takes; zero means that it is not complete.
  std::size_t bytes = 0;
};

// The integer at the begin of `bytes`.
Varint read_varint(std::span<const std::uint8_t> bytes);

// Appends the shortest form. Asserts that the value is at most kVarintMax.
void put_varint(Bytes& out, std::uint64_t value);

}  // namespace hairnet::http3
