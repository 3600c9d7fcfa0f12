#include "server/grooms/level_cache.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "core/assert.hpp"
#include "schema/wire/level_file.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {

LevelCache::LevelCache(std::filesystem::path folder, std::uint64_t bytes_max, LevelCacheCounters& counters)
    : folder_({std::move(folder), wire::kLevelFileSuffix, bytes_max, wire::kLevelFileBytesMax,
               "level_cache_write_failed", "levels"},
              counters.level_cache_written, counters.level_cache_writes_failed, counters.level_cache_evicted),
      counters_(&counters) {}

std::shared_ptr<LevelSet> LevelCache::find(const wire::GroomHash& groom) {
  const CacheFolder::Found file = folder_.read(groom);
  switch (file.outcome) {
    case CacheFolder::Outcome::read:
      break;
    case CacheFolder::Outcome::absent:
      counters_->level_cache_misses.add();
      return nullptr;
    case CacheFolder::Outcome::unreadable:
      count("cannot be read", groom, counters_->level_cache_rejected_unreadable);
      return nullptr;
    case CacheFolder::Outcome::too_large:
      count("too large", groom, counters_->level_cache_rejected_damaged);
      return nullptr;
  }
  wire::DecodedLevels decoded = wire::decode_levels(file.bytes, groom);
  switch (decoded.fault) {
    case wire::LevelFileFault::none:
      break;
    case wire::LevelFileFault::not_a_level_file:
      count(decoded.detail, groom, counters_->level_cache_rejected_format);
      return nullptr;
    case wire::LevelFileFault::other_version:
      count(decoded.detail, groom, counters_->level_cache_rejected_version);
      return nullptr;
    case wire::LevelFileFault::other_groom:
      count(decoded.detail, groom, counters_->level_cache_rejected_groom);
      return nullptr;
    case wire::LevelFileFault::damaged:
      count(decoded.detail, groom, counters_->level_cache_rejected_damaged);
      return nullptr;
    case wire::LevelFileFault::unsound:
      count(decoded.detail, groom, counters_->level_cache_rejected_unsound);
      return nullptr;
  }
  HAIRNET_ASSERT(decoded.levels);
  counters_->level_cache_hits.add();
  folder_.touch(groom);
  return std::move(decoded.levels);
}

void LevelCache::put(const wire::GroomHash& groom, const LevelSet& set) {
  folder_.put(groom, wire::encode_levels(groom, set));
}

void LevelCache::count(const std::string& detail, const wire::GroomHash& groom, Counter& counter) {
  counter.add();
  spdlog::info("event=level_cache_rejected file={} detail={}", log_text(folder_.path_of(groom).string()),
               log_text(detail));
}

}  // namespace hairnet::server
