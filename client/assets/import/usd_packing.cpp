#include "client/assets/import/usd_packing.hpp"

#include <utility>

#include "core/assert.hpp"

namespace hairnet::usda {
namespace {

// Unpacks one LZ4 block to the end of `out`, which gets no more than `bytes_max` bytes. Returns whether it is valid.
bool unpack_lz4(CrateBytes packed, std::size_t bytes_max, std::vector<std::byte>& out) {
  // A copy has 4 bytes at least, which its length leaves out. A length of 15 goes on in the next byte.
  constexpr std::size_t kShortest = 4, kMore = 15;
  std::size_t at = 0;
  // Lengths of 15 go on in further bytes, as long as these are 255.
  const auto length = [&](std::size_t begin) {
    if (begin < kMore) return begin;
    std::size_t more = 255;
    for (; more == 255 && at < packed.size(); begin += more) more = std::to_integer<std::size_t>(packed[at++]);
    return begin;
  };
  while (at < packed.size()) {
    const auto token = std::to_integer<std::size_t>(packed[at++]);
    const std::size_t literals = length(token >> 4);
    if (literals > packed.size() - at || literals > bytes_max - out.size()) return false;
    out.insert(out.end(), packed.begin() + static_cast<std::ptrdiff_t>(at),
               packed.begin() + static_cast<std::ptrdiff_t>(at + literals));
    at += literals;
    // The last sequence of a block has literals alone.
    if (at == packed.size()) return true;
    if (packed.size() - at < 2) return false;
    // The distance back from the end of `out` to the bytes to be copied.
    const std::size_t back = std::to_integer<std::size_t>(packed[at]) | std::to_integer<std::size_t>(packed[at + 1])
                                                                            << 8;
    at += 2;
    const std::size_t copied = length(token & 15) + kShortest;
    if (back == 0 || back > out.size() || copied > bytes_max - out.size()) return false;
    // Source and target may overlap: a copy of the last byte repeats it, so bytes are copied one by one.
    for (std::size_t i = 0; i < copied; ++i) out.push_back(out[out.size() - back]);
  }
  return true;
}

// Whether this many packed bytes can hold this many whole numbers. LZ4 makes at most 255 bytes of one, and a number
// takes 2 bits, so a packed byte gives at most 4 x 255 = 1020 numbers. Since few bytes can still stand for many
// numbers, more than 16 million are refused too: twice the points of the largest groom.
bool can_hold(std::size_t packed_bytes, std::uint64_t count) {
  constexpr std::uint64_t kNumbersMax = 16'000'000;
  return count / 1020 <= packed_bytes && count <= kNumbersMax;
}

}  // namespace

std::optional<std::vector<std::byte>> unpack(CrateBytes packed, std::size_t bytes_max) {
  // The first byte is the number of blocks, 0 for a single one without a size.
  std::vector<std::byte> out;
  ByteReader in(packed);
  if (!in.has(1)) return {};
  const auto blocks = std::to_integer<std::size_t>(packed[0]);
  in.skip(1);
  if (blocks == 0) return unpack_lz4(packed.subspan(1), bytes_max, out) ? std::optional(std::move(out)) : std::nullopt;
  for (std::size_t i = 0; i < blocks; ++i) {
    if (!in.has(4)) return {};
    const std::size_t size = in.u32();
    if (!in.has(size) || !unpack_lz4(packed.subspan(in.at(), size), bytes_max, out)) return {};
    in.skip(size);
  }
  return out;
}

std::optional<std::vector<std::int64_t>> unpack_integers(ByteReader& in, std::uint64_t count, std::size_t bytes_of_each,
                                                         CrateBytes file) {
  HAIRNET_ASSERT(bytes_of_each == 4 || bytes_of_each == 8);
  if (!in.has(8)) return {};
  const std::uint64_t packed_bytes = in.u64();
  if (!in.has(packed_bytes, 1) || !can_hold(packed_bytes, count)) return {};
  const CrateBytes packed = file.subspan(in.at(), packed_bytes);
  in.skip(packed_bytes);
  // The layout is the most common difference, two bits for each number, and then the differences that are not common.
  const std::size_t code_bytes = (count + 3) / 4;
  const auto encoded = unpack(packed, bytes_of_each + code_bytes + count * bytes_of_each);
  if (!encoded || encoded->size() < bytes_of_each + code_bytes) return {};
  const auto read = [&](std::size_t at, std::size_t size) {
    // The sign of a small number is spread by shifting it up and down again.
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < size; ++i) bits |= std::to_integer<std::uint64_t>((*encoded)[at + i]) << (8 * i);
    const std::size_t unused = 64 - 8 * size;
    return static_cast<std::int64_t>(bits << unused) >> unused;
  };
  const std::int64_t common = read(0, bytes_of_each);
  std::size_t at = bytes_of_each + code_bytes;
  std::vector<std::int64_t> values;
  values.reserve(count);
  std::uint64_t last = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const unsigned code = (std::to_integer<unsigned>((*encoded)[bytes_of_each + i / 4]) >> (2 * (i % 4))) & 3U;
    // The codes mean the common difference, a quarter, a half and the whole of a number's bytes.
    const std::size_t size = code == 0 ? 0 : (bytes_of_each / 4) << (code - 1);
    if (size > encoded->size() - at) return {};
    // Sums wrap around in 64 bits without a sign, as the writer's differences do.
    last += static_cast<std::uint64_t>(size == 0 ? common : read(at, size));
    at += size;
    values.push_back(bytes_of_each == 4 ? static_cast<std::int32_t>(last) : static_cast<std::int64_t>(last));
  }
  return values;
}

}  // namespace hairnet::usda
