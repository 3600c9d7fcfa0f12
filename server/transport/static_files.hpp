#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "server/transport/content_coding.hpp"

namespace hairnet::server {

// A file open for reading, or its compressed copy. `etag` changes when the file changes, and with the coding.
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
  // Empty: the bytes are the file's own, without compression.
  std::string content_encoding;

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
  // The error is one line.
  static Result<std::unique_ptr<StaticFiles>> open(const std::string& folder);
  ~StaticFiles();
  // `path` as in the request, from '/' on and without the query. A path that ends in '/' means its index.html; the
  // result `is_folder` means a folder without that '/'. `codings` end with identity: the first one counts in which the
  // file or a compressed copy beside it ("index.js.br", "index.js.gz") exists.
  StaticFind find(std::string_view path, StaticFile& file,
                  const std::vector<ContentCoding>& codings = {ContentCoding::identity}) const;

 private:
  explicit StaticFiles(int folder) : folder_(folder) {}
  int folder_;
};

// Decodes percent signs, once. False when the path is not valid: an encoded control character, NUL, slash or backslash,
// a wrong percent code, no '/' in front.
bool decode_path(std::string_view path, std::string& decoded);

}  // namespace hairnet::server
