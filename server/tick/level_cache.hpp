#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "core/build/level.hpp"
#include "schema/wire/messages.hpp"
#include "server/tick/tick_counters.hpp"

namespace hairnet::server {

// Built levels on disk, a file a groom, so that a server need not build what one before it has built. A file is used
// only when it is whole, of this build and this groom, and its levels are sound; else it counts as absent, and the next
// put replaces it. Files are written apart and renamed into place, so that any number of servers may share a folder.
// Whoever can write to the folder can give every character other hair, though never an unsound level: it should be the
// server's own. Nothing of the disk's is a failure: what cannot be read is built, what cannot be written is warned of
// once. The builder's thread.
class LevelCache {
 public:
  // Makes the folder (and its parents) when it is not there.
  LevelCache(std::filesystem::path folder, std::uint64_t bytes_max, LevelCacheCounters& counters);

  // Null when there are none that can be used. Without the maps between the levels (connect_levels).
  [[nodiscard]] std::shared_ptr<LevelSet> find(const wire::GroomHash& groom);
  // Makes room by removing the files that were used least lately.
  void put(const wire::GroomHash& groom, const LevelSet& set);

 private:
  [[nodiscard]] std::filesystem::path path_of(const wire::GroomHash& groom) const;
  void count(const std::string& detail, const std::filesystem::path& path, Counter& counter);
  // The error of the system; 0 when done.
  [[nodiscard]] int write(const std::filesystem::path& path, std::span<const std::uint8_t> bytes) const;
  void warn_once(const std::string& what);
  void make_room(const std::filesystem::path& newest);

  std::filesystem::path folder_;
  std::uint64_t bytes_max_;
  LevelCacheCounters* counters_;
  bool warned_ = false;
};

}  // namespace hairnet::server
