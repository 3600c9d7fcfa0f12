#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

namespace hairnet::server {

// Reads a whole file of text for an operator: of settings, keys, certificates, names. Never blocks on what is no file:
// a pipe or a device is refused, as is a folder. A byte order mark at the front is left out, and the ends of lines
// become those of Unix. The error is what is wrong, without the file's name: "is a pipe or device, not a file".
Result<std::string> read_text_file(const std::string& path, std::size_t bytes_max);

// The first line, which `text` loses.
std::string_view take_line(std::string_view& text);

// Empty when the program can keep files in the folder, which is made with its parents where it does not exist; else one
// line that names it. Writes a file there and removes it; a disk that is full now is no error. Adds the folders that it
// made to `made`, the outermost first.
std::string try_folder(const std::string& path, std::vector<std::string>& made);

// Empty when a file of that name can be written; else what is wrong. Pipes and devices are refused, since writing to
// them could block. Leaves an existing file as it is.
std::string try_file(const std::string& path);

}  // namespace hairnet::server
