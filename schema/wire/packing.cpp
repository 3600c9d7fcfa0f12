#include "schema/wire/packing.hpp"

#include <string>

#include "schema/wire/flatbuffer_convert.hpp"

namespace hairnet::wire {
namespace {

using flatbuffers::FlatBufferBuilder;

// Deflate takes at least two bits for a match of at most 258 bytes, which makes 1032 bytes out of one.
constexpr std::size_t kDeflateRatioMax = 1032;

}  // namespace

std::vector<std::uint8_t> pack(std::span<const std::uint8_t> table, const char* identifier, PackEffort effort) {
  const std::vector<std::uint8_t> stream = bytes::deflated(table, effort);
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
  // The announced size is checked before memory is taken for it, else a file of some bytes could take 256 MiB.
  if (byte_count < kPacketBytesMin || byte_count / kDeflateRatioMax > root->stream()->size())
    return Refusal("not whole: its stream cannot be as long as it says");
  std::vector<std::uint8_t> table(byte_count);
  switch (bytes::inflate_into({root->stream()->data(), root->stream()->size()}, table)) {
    case bytes::InflateError::damaged:
      return Refusal("not whole: its stream is damaged");
    case bytes::InflateError::wrong_length:
      return Refusal("not whole: its stream is not as long as it says");
    case bytes::InflateError::none:
      break;
  }
  return table;
}

std::size_t unpacked_bytes(std::span<const std::uint8_t> file, const char* identifier) {
  if (!is_packed(file, identifier)) return file.size();
  const AlignedBytes aligned(file);
  const auto* root = verified_root<fb::PackedTable>(aligned.bytes(), identifier);
  return root ? root->unpacked_bytes() : 0;
}

}  // namespace hairnet::wire
