#pragma once

#include <cstddef>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace hairnet {

// Writes an OutputFile: a reader sees either the old or the whole new file. The error does not name the file.
Result<void> write_file(const std::string& path, std::span<const std::byte> bytes);

// Whether files could be written there, so that a program says so before it works for minutes. Empty paths are skipped.
// The error names the file and what to do.
Result<void> check_can_write(std::initializer_list<std::string_view> paths);

}  // namespace hairnet
