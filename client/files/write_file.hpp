#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "core/result.hpp"

namespace hairnet {

// Writes beside `path` and renames, so that a reader sees the old file or the whole new one, and a failure leaves the
// old one alone. A device or pipe is written directly. The reason of a refusal does not name the file.
Result<void> write_file(const std::string& path, std::span<const std::byte> bytes);

}  // namespace hairnet
