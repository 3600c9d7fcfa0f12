#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <set>
#include <vector>

#include "schema/wire/messages.hpp"
#include "server/grooms/cache_folder.hpp"
#include "server/grooms/groom_counters.hpp"

namespace hairnet::server {

// A cache of uploaded groom files on disk, named by their hashes, so that a groom is uploaded once for all servers and
// restarts. A file whose bytes do not have the hash of its name is removed and counts as absent. See CacheFolder.
// Builder thread; is_cached() is for any thread.
class GroomCache {
 public:
  using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;
  GroomCache(std::filesystem::path folder, std::uint64_t bytes_max, GroomCacheCounters& counters);

  // Whether the file existed when the folder was last listed: it may be gone by now, or damaged. Does not read the
  // disk. Any thread.
  [[nodiscard]] bool is_cached(const wire::GroomHash& groom) const;
  // Lists the folder again, because other servers may have added grooms.
  void refresh();

  // The groom's file; null when there is no valid one.
  [[nodiscard]] Bytes find(const wire::GroomHash& groom);
  // `bytes` must have the hash `groom`.
  void put(const wire::GroomHash& groom, std::span<const std::uint8_t> bytes);

 private:
  void reject(const char* why, const wire::GroomHash& groom, Counter& counter);
  void forget(const wire::GroomHash& groom);

  CacheFolder folder_;
  GroomCacheCounters* counters_;
  mutable std::mutex mutex_;
  std::set<wire::GroomHash> known_;
};

}  // namespace hairnet::server
