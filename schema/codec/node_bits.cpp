#include "schema/codec/node_bits.hpp"

#include <algorithm>

namespace hairnet::codec {

void put_long_node(BitWriter& writer, const ZigzagNode& z, unsigned k) {
  HAIRNET_ASSERT(k <= kRiceParameterMax);
  for (const std::uint16_t integer : z) {
    const unsigned zeros = static_cast<unsigned>(integer) >> k;
    if (zeros < kZerosMax) {
      writer.put(std::uint64_t{1} << zeros, zeros + 1);
    } else {
      writer.put(0, kZerosMax);
    }
  }
  for (const std::uint16_t integer : z) {
    const unsigned bits = static_cast<unsigned>(integer) >> k < kZerosMax ? k : 16;
    writer.put(integer & ((1u << bits) - 1), bits);
  }
}

ZigzagNode take_long_node(BitReader& reader, unsigned k) {
  HAIRNET_ASSERT(k <= kRiceParameterMax);
  std::array<unsigned, 3> zeros;
  for (unsigned& count : zeros) {
    count = std::min(static_cast<unsigned>(std::countr_zero(reader.peek())), kZerosMax);
    reader.skip(count < kZerosMax ? count + 1 : kZerosMax);
  }
  ZigzagNode z;
  for (unsigned i = 0; i < 3; ++i) {
    z[i] = zeros[i] < kZerosMax ? static_cast<std::uint16_t>(zeros[i] << k | reader.take(k))
                                : static_cast<std::uint16_t>(reader.take(16));
  }
  return z;
}

}  // namespace hairnet::codec
