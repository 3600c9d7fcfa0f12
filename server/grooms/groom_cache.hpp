#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <set>
#include <vector>

#include "schema/wire/messages.hpp"
#include "server/grooms/cache_folder.hpp"
#include "server/grooms/cache_objects.hpp"
#include "server/grooms/groom_counters.hpp"

namespace hairnet::server {

// A cache of uploaded groom files on disk, named by their hashes, so that a groom is uploaded once for all servers and
// restarts. A file whose bytes do not have the hash of its name is removed and counts as absent: nobody who can write
// to the folder or the store can slip in another groom under a known name. See CacheFolder. With an object store, what
// the folder lacks is read from there, and what the folder has is put there. Any thread; what may ask the store waits
// for it.
class GroomCache {
 public:
  using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;
  // `objects` may be null.
  GroomCache(std::filesystem::path folder, std::uint64_t bytes_max, GroomCacheCounters& counters,
             std::unique_ptr<CacheObjects> objects = nullptr);
  static CacheObjectsDef objects_def(ObjectCounters& counters);

  // Whether the file existed when the folder was last listed: it may be gone by now, or damaged. Does not read the
  // disk.
  [[nodiscard]] bool is_cached(const wire::GroomHash& groom) const;
  // Lists the folder again, because other servers may have added grooms.
  void refresh();

  // The groom's file; null when there is no valid one. May ask the store.
  [[nodiscard]] Bytes find(const wire::GroomHash& groom);
  // `bytes` must have the hash `groom`.
  void put(const wire::GroomHash& groom, std::span<const std::uint8_t> bytes);

  // Brings the groom from the store to the folder. True when the folder has it.
  bool pull(const wire::GroomHash& groom);
  // Puts one file that waits into the store. False when there is none, or the store takes none now.
  bool put_next();
  [[nodiscard]] std::size_t waiting_puts() const { return objects_ ? objects_->waiting() : 0; }

 private:
  // These two look in one of the two places, check the hash of what they find, and count hits, misses and rejections.
  // read_store() also writes the file to the folder.
  Bytes read_folder(const wire::GroomHash& groom);
  Bytes read_store(const wire::GroomHash& groom);
  // Counts and logs a file that is not valid, and removes it from the folder.
  void reject(const char* error, const wire::GroomHash& groom, Counter& counter);
  // The folder does not have the groom any more.
  void forget(const wire::GroomHash& groom);

  CacheFolder folder_;
  GroomCacheCounters* counters_;
  std::unique_ptr<CacheObjects> objects_;
  mutable std::mutex mutex_;
  // The grooms that the folder had when it was last listed. is_cached() answers from this set, because the I/O thread
  // must not wait for a disk.
  std::set<wire::GroomHash> known_;
};

}  // namespace hairnet::server
