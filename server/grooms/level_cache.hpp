#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "core/levels/level.hpp"
#include "schema/wire/messages.hpp"
#include "server/grooms/cache_folder.hpp"
#include "server/grooms/cache_objects.hpp"
#include "server/grooms/groom_counters.hpp"

namespace hairnet::server {

// Built levels on disk, one file a groom, so that a server does not rebuild what an earlier one has built. A file is
// used only if it is complete, belongs to this build and this groom, and its levels are valid; otherwise it counts as
// absent, and the next put replaces it. A process that can write to the folder can replace every character's hair, but
// only by valid levels: the folder should belong to the server alone. See CacheFolder. With an object store, what the
// folder lacks is read from there, by the same rules, and what the folder has is put there. Any thread; what may ask
// the store waits for it.
class LevelCache {
 public:
  // `objects` may be null.
  LevelCache(std::filesystem::path folder, std::uint64_t bytes_max, LevelCacheCounters& counters,
             std::unique_ptr<CacheObjects> objects = nullptr);
  static CacheObjectsDef objects_def(ObjectCounters& counters);

  // Null when there are no valid ones. Without the maps between the levels (make_level_maps). May ask the store.
  [[nodiscard]] std::shared_ptr<LevelSet> find(const wire::GroomHash& groom);
  // Writes the levels, with what was learnt, to the folder. A failure is counted and logged there; the caller goes on
  // with the levels that it has.
  void put(const wire::GroomHash& groom, const LevelSet& set);

  // Puts one file that waits into the store. False when there is none, or the store takes none now.
  bool put_next();
  [[nodiscard]] std::size_t waiting_puts() const { return objects_ ? objects_->waiting() : 0; }

 private:
  // These two look in one of the two places, and return only valid levels of this build. read_store() also writes the
  // file to the folder.
  std::shared_ptr<LevelSet> read_folder(const wire::GroomHash& groom);
  std::shared_ptr<LevelSet> read_store(const wire::GroomHash& groom);
  // Counts and logs a file that was rejected. It stays in the folder, until the next put replaces it.
  void count(const std::string& detail, const wire::GroomHash& groom, Counter& counter);

  CacheFolder folder_;
  LevelCacheCounters* counters_;
  std::unique_ptr<CacheObjects> objects_;
};

}  // namespace hairnet::server
