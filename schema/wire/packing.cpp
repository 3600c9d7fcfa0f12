#include "schema/wire/packing.hpp"

#include <zlib.h>

#include <new>
#include <string>

#include "schema/wire/flatbuffer_convert.hpp"

namespace hairnet::wire {
namespace {

using flatbuffers::FlatBufferBuilder;

constexpr std::size_t kDeflateRatioMax = 1032;  // a match of 258 bytes takes two bits at least
constexpr int kRawWindowBits = -15;             // a raw stream, without a header and a checksum
constexpr int kMemoryLevel = 9;

std::vector<std::uint8_t> deflated(std::span<const std::uint8_t> bytes, PackEffort effort) {
  z_stream z{};
  // Z_FILTERED: most bytes are small numbers with random lower bits, in which longer matches are chance.
  const int strategy = effort == PackEffort::quick ? Z_HUFFMAN_ONLY : Z_FILTERED;
  if (deflateInit2(&z, Z_BEST_COMPRESSION, Z_DEFLATED, kRawWindowBits, kMemoryLevel, strategy) != Z_OK)
    throw std::bad_alloc();
  std::vector<std::uint8_t> out(deflateBound(&z, bytes.size()));
  z.next_in = const_cast<std::uint8_t*>(bytes.data());
  z.avail_in = static_cast<uInt>(bytes.size());
  z.next_out = out.data();
  z.avail_out = static_cast<uInt>(out.size());
  const int result = deflate(&z, Z_FINISH);
  HAIRNET_ASSERT(result == Z_STREAM_END);
  out.resize(z.total_out);
  deflateEnd(&z);
  return out;
}

// Fills `out`, whose size is that of the unpacked bytes.
std::string inflate_into(std::span<const std::uint8_t> stream, std::span<std::uint8_t> out) {
  z_stream z{};
  if (inflateInit2(&z, kRawWindowBits) != Z_OK) throw std::bad_alloc();
  z.next_in = const_cast<std::uint8_t*>(stream.data());
  z.avail_in = static_cast<uInt>(stream.size());
  z.next_out = out.data();
  z.avail_out = static_cast<uInt>(out.size());
  const int result = inflate(&z, Z_FINISH);
  inflateEnd(&z);
  if (result == Z_MEM_ERROR) throw std::bad_alloc();
  if (result == Z_STREAM_END && z.avail_out == 0 && z.avail_in == 0) return {};
  if (result == Z_DATA_ERROR || result == Z_NEED_DICT) return "not whole: its stream is damaged";
  return "not whole: its stream is not as long as it says";
}

}  // namespace

std::vector<std::uint8_t> pack(std::span<const std::uint8_t> table, const char* identifier, PackEffort effort) {
  const std::vector<std::uint8_t> stream = deflated(table, effort);
  FlatBufferBuilder to(stream.size() + 64);
  const auto flat_stream = to.CreateVector(stream);
  return finish(to, fb::CreatePackedTable(to, static_cast<std::uint32_t>(table.size()), flat_stream), identifier);
}

bool is_packed(std::span<const std::uint8_t> file, const char* identifier) {
  return has_identifier(file, identifier);
}

Result<std::vector<std::uint8_t>> unpack(std::span<const std::uint8_t> file, const char* identifier) {
  const AlignedBytes aligned(file);
  const auto* root = verified_root<fb::PackedTable>(aligned.bytes(), identifier);
  if (!root) return Refusal("not whole: cut off or damaged");
  const std::size_t byte_count = root->unpacked_bytes();
  if (byte_count > kGroomBytesMax)
    return Refusal(std::to_string(byte_count) + " bytes when unpacked, more than the limit of " +
                   std::to_string(kGroomBytesMax));
  if (byte_count < kPacketBytesMin || byte_count / kDeflateRatioMax > root->stream()->size())
    return Refusal("not whole: its stream cannot be as long as it says");
  std::vector<std::uint8_t> table(byte_count);
  std::string fault = inflate_into({root->stream()->data(), root->stream()->size()}, table);
  if (!fault.empty()) return Refusal(std::move(fault));
  return table;
}

std::size_t unpacked_bytes(std::span<const std::uint8_t> file, const char* identifier) {
  if (!is_packed(file, identifier)) return file.size();
  const AlignedBytes aligned(file);
  const auto* root = verified_root<fb::PackedTable>(aligned.bytes(), identifier);
  return root ? root->unpacked_bytes() : 0;
}

}  // namespace hairnet::wire
