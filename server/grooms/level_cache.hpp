#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "core/levels/level.hpp"
#include "schema/wire/messages.hpp"
#include "server/grooms/cache_folder.hpp"
#include "server/grooms/groom_counters.hpp"

namespace hairnet::server {

// Built levels on disk, one file a groom, so that a server does not rebuild what an earlier one has built. A file is
// used only if it is complete, belongs to this build and this groom, and its levels are valid; otherwise it counts as
// absent, and the next put replaces it. A process that can write to the folder can replace every character's hair, but
// only by valid levels: the folder should belong to the server alone. See CacheFolder. Builder thread.
class LevelCache {
 public:
  LevelCache(std::filesystem::path folder, std::uint64_t bytes_max, LevelCacheCounters& counters);

  // Null when there are no valid ones. Without the maps between the levels (make_level_maps).
  [[nodiscard]] std::shared_ptr<LevelSet> find(const wire::GroomHash& groom);
  void put(const wire::GroomHash& groom, const LevelSet& set);

 private:
  void count(const std::string& detail, const wire::GroomHash& groom, Counter& counter);

  CacheFolder folder_;
  LevelCacheCounters* counters_;
};

}  // namespace hairnet::server
