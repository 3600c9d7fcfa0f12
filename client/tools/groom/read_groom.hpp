#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/groom/groom.hpp"
#include "core/result.hpp"
#include "schema/wire/groom_file.hpp"

namespace hairnet::groom {

// A groom file that was read.
struct GroomFile {
  // The hash of the file's bytes, which names the groom for servers and caches.
  wire::GroomHash hash{};
  // It has at least one point of hair.
  Groom groom;
};

// Reads a groom file for commands whose results are stored by its hash: so it refuses made:STYLE and strand files,
// which have no bytes to hash. The error names the file.
Result<GroomFile> read_groom(const std::string& path);

// Both views are of the same bytes: files are std::byte, the wire uint8_t.
inline std::span<const std::uint8_t> as_octets(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

}  // namespace hairnet::groom
