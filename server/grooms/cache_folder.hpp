#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "schema/wire/messages.hpp"
#include "server/telemetry/counter.hpp"

namespace hairnet::server {

struct CacheFolderDef {
  std::filesystem::path folder;
  // A file's name is the groom's hash and this suffix, which begins with a dot.
  std::string suffix;
  // Bounds all its files together.
  std::uint64_t bytes_max = 0;
  // Bounds each file.
  std::size_t file_bytes_max = 0;
  // The log event when a file cannot be written.
  std::string write_failed_event;
  // What the files contain, in words for log lines.
  std::string contents;
  // Bounds the files, since every put lists the whole folder.
  std::size_t file_count_max = 8192;
};

// An LRU cache of files in one folder, bounded in bytes and files. Each file is named by the hash of a groom. A file is
// written under a temporary name and renamed, so several servers may share the folder and never find half a file; the
// reader checks its content. Files with other names or suffixes are not touched. A disk error is no failure of the
// server: it is counted, and one warning is logged. Any thread.
class CacheFolder {
 public:
  // Makes the folder (and its parents) if it does not exist. The counters must outlive it.
  CacheFolder(CacheFolderDef def, Counter& written, Counter& writes_failed, Counter& evicted);

  enum class Outcome : std::uint8_t { read, absent, unreadable, too_large };
  struct Found {
    Outcome outcome = Outcome::absent;
    // The content when the outcome is `read`, else empty.
    std::vector<std::uint8_t> bytes;
  };
  // Never blocks, even if a pipe has the file's name. It does not check the content: a file may be damaged, or another
  // program's, so the caller does.
  [[nodiscard]] Found read(const wire::GroomHash& groom) const;
  // Sets the file's last use to now, by which make_room() chooses the files to remove. The modification time stores it,
  // since many disks are mounted without times of access.
  void touch(const wire::GroomHash& groom) const;
  // Replaces an existing file. Makes room by removing other files, those first that were used least recently. False
  // when the file was not stored.
  bool put(const wire::GroomHash& groom, std::span<const std::uint8_t> bytes);
  // Removes regular files only.
  void remove(const wire::GroomHash& groom) const;
  // The hashes of all files in the folder.
  [[nodiscard]] std::vector<wire::GroomHash> hashes() const;
  [[nodiscard]] std::filesystem::path path_of(const wire::GroomHash& groom) const;

 private:
  // Returns the system's error, or 0.
  [[nodiscard]] int write(const std::filesystem::path& path, std::span<const std::uint8_t> bytes) const;
  // Logs the first error of a write; later ones are only counted.
  void warn_once(std::string_view what);
  // Removes files, the least recently used first, until the bounds of bytes and files hold. Leaves `newest`.
  void make_room(const std::filesystem::path& newest);

  CacheFolderDef def_;
  Counter *written_, *writes_failed_, *evicted_;
  std::atomic<bool> warned_{false};
};

}  // namespace hairnet::server
