#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace hairnet::server {

// A file open for reading. `etag` changes when the file does.
class StaticFile {
 public:
  StaticFile() = default;
  StaticFile(StaticFile&& other) noexcept;
  StaticFile& operator=(StaticFile&& other) noexcept;
  ~StaticFile();
  // Reads bytes from `offset` on, until `into` is full or the file ends.
  [[nodiscard]] std::size_t read(std::uint64_t offset, std::span<std::uint8_t> into) const;

  std::uint64_t bytes = 0;
  std::string etag, content_type, cache_control;

 private:
  friend class StaticFiles;
  int descriptor_ = -1;
};

enum class StaticFind : std::uint8_t { found, not_found, bad_path, is_folder };

// The files of one folder, by the path of a request. Nothing outside the folder is ever opened: a path is decoded once
// and walked name by name from the folder's own descriptor, and neither symbolic links nor names that begin with a dot
// are followed. Any thread.
class StaticFiles {
 public:
  // One line when the folder cannot be opened.
  static Result<std::unique_ptr<StaticFiles>> open(const std::string& folder);
  ~StaticFiles();
  // `path` as it was sent, from '/' on and without the query. A path that ends in '/' means its index.html; `is_folder`
  // is a folder without that '/'.
  StaticFind find(std::string_view path, StaticFile& file) const;

 private:
  explicit StaticFiles(int folder) : folder_(folder) {}
  int folder_;
};

// Percent signs decoded, once. False when it is not a path to look for: a control character, NUL, slash or backslash in
// percent signs, bytes that are no percent code, no '/' in front.
bool decode_path(std::string_view path, std::string& decoded);

}  // namespace hairnet::server
