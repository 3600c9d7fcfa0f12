#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "core/result.hpp"

namespace hairnet {

// Writes a temporary file beside `path` and renames it, so that a reader sees either the old or the whole new file, and
// a failure leaves the old one unchanged. A device or pipe is written directly. The error does not name the file.
Result<void> write_file(const std::string& path, std::span<const std::byte> bytes);

}  // namespace hairnet
