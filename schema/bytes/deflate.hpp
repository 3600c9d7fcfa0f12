#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace hairnet::bytes {

enum class PackEffort : std::uint8_t {
  // The usual effort of zlib, for files that are made once. Its best one would save 1 % of a groom's bytes.
  most,
  // Huffman codes alone, for what somebody waits for.
  quick,
};

// A raw stream of RFC 1951, without a header and a checksum. The same bytes give the same stream for one version of
// zlib.
std::vector<std::uint8_t> deflated(std::span<const std::uint8_t> bytes, PackEffort effort);

enum class InflateError : std::uint8_t {
  none,
  damaged,
  // The stream, or what it holds, is shorter or longer than it must be.
  wrong_length,
};
// Fills `out`, whose size is that of the unpacked bytes. After an error its bytes are unspecified. It writes nothing
// beyond `out`, whatever the stream says.
InflateError inflate_into(std::span<const std::uint8_t> stream, std::span<std::uint8_t> out);

}  // namespace hairnet::bytes
