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

struct GroomFile {
  wire::GroomHash hash{};
  Groom groom;  // it has hair
};

// What is stored for a groom is for the very bytes of its file. The error names the file.
Result<GroomFile> read_groom(const std::string& path);

inline std::span<const std::uint8_t> as_octets(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

}  // namespace hairnet::groom
