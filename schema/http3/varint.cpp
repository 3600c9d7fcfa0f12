#include "schema/http3/varint.hpp"

#include "core/assert.hpp"

namespace hairnet::http3 {

Varint read_varint(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return {};
  // The first two bits say how many bytes there are: 1, 2, 4 or 8.
  const std::size_t count = std::size_t{1} << (bytes[0] >> 6);
  if (bytes.size() < count) return {};
  std::uint64_t value = bytes[0] & 0x3f;
  for (std::size_t i = 1; i < count; ++i) value = value << 8 | bytes[i];
  return {value, count};
}

void put_varint(Bytes& out, std::uint64_t value) {
  HAIRNET_ASSERT(value <= kVarintMax);
  const unsigned log2_bytes = value < 1u << 6 ? 0 : value < 1u << 14 ? 1 : value < 1u << 30 ? 2 : 3;
  const unsigned count = 1u << log2_bytes;
  for (unsigned i = count; i-- > 0;) {
    auto byte = static_cast<std::uint8_t>(value >> (8 * i));
    if (i + 1 == count) byte = static_cast<std::uint8_t>(byte | log2_bytes << 6);
    out.push_back(byte);
  }
}

}  // namespace hairnet::http3
