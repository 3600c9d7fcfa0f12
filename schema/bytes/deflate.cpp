#include "schema/bytes/deflate.hpp"

#include <zlib.h>

#include <new>

#include "core/assert.hpp"

namespace hairnet::bytes {
namespace {

// A negative number means to zlib a raw stream without header and checksum. 15 is the largest window, 32 KiB.
constexpr int kRawWindowBits = -15;
// The largest memory level that zlib has.
constexpr int kMemoryLevel = 9;

}  // namespace

std::vector<std::uint8_t> deflated(std::span<const std::uint8_t> bytes, PackEffort effort) {
  z_stream z{};
  // Z_FILTERED fits data whose bytes are mostly small numbers with random lower bits, in which longer matches are
  // chance.
  const int strategy = effort == PackEffort::quick ? Z_HUFFMAN_ONLY : Z_FILTERED;
  if (deflateInit2(&z, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kRawWindowBits, kMemoryLevel, strategy) != Z_OK)
    throw std::bad_alloc();
  std::vector<std::uint8_t> out(deflateBound(&z, bytes.size()));
  z.next_in = const_cast<std::uint8_t*>(bytes.data());
  // The bytes are a FlatBuffer, which is smaller than 2 GiB, so the size fits zlib's 32 bits.
  z.avail_in = static_cast<uInt>(bytes.size());
  z.next_out = out.data();
  z.avail_out = static_cast<uInt>(out.size());
  const int result = deflate(&z, Z_FINISH);
  HAIRNET_ASSERT(result == Z_STREAM_END);
  out.resize(z.total_out);
  deflateEnd(&z);
  return out;
}

InflateError inflate_into(std::span<const std::uint8_t> stream, std::span<std::uint8_t> out) {
  z_stream z{};
  if (inflateInit2(&z, kRawWindowBits) != Z_OK) throw std::bad_alloc();
  z.next_in = const_cast<std::uint8_t*>(stream.data());
  z.avail_in = static_cast<uInt>(stream.size());
  z.next_out = out.data();
  z.avail_out = static_cast<uInt>(out.size());
  const int result = inflate(&z, Z_FINISH);
  inflateEnd(&z);
  if (result == Z_MEM_ERROR) throw std::bad_alloc();
  // The stream must end exactly where both spans do. Bytes behind it would let one groom have many hashes.
  if (result == Z_STREAM_END && z.avail_out == 0 && z.avail_in == 0) return InflateError::none;
  if (result == Z_DATA_ERROR || result == Z_NEED_DICT) return InflateError::damaged;
  return InflateError::wrong_length;
}

}  // namespace hairnet::bytes
