#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace hairnet {

// Largest file that the programs read: twice the largest real input that fits in a groom.
inline constexpr std::size_t kFileBytesMax = std::size_t{512} << 20;

// Reads the whole file. Returns an error for a directory, a pipe or device (it might never end), an unreadable or empty
// file, and one of more than `bytes_max` bytes; the error does not name the file.
Result<std::vector<std::byte>> read_file(const std::string& path, std::size_t bytes_max = kFileBytesMax);

// The same bytes as characters, for text formats.
inline std::string_view as_text(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace hairnet
