#include "server/grooms/level_cache.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "core/assert.hpp"
#include "core/levels/build.hpp"
#include "schema/wire/level_file.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {

// Servers of different builds may share a store, so each build has names of its own: with common names, each would
// reject and replace the other's levels all the time.
CacheObjectsDef LevelCache::objects_def(ObjectCounters& c) {
  return {.suffix = fmt::format("-{}{}", kBuildVersion, wire::kLevelFileSuffix),
          .bytes_max = wire::kLevelFileBytesMax,
          .read = &c.read_levels,
          .absent = &c.absent_levels,
          .stored = &c.stored_levels,
          .kept = &c.kept_levels,
          .rejected = &c.rejected_levels};
}

LevelCache::LevelCache(std::filesystem::path folder, std::uint64_t bytes_max, LevelCacheCounters& counters,
                       std::unique_ptr<CacheObjects> objects)
    : folder_({std::move(folder), wire::kLevelFileSuffix, bytes_max, wire::kLevelFileBytesMax,
               "level_cache_write_failed", "levels"},
              counters.level_cache_written, counters.level_cache_writes_failed, counters.level_cache_evicted),
      counters_(&counters),
      objects_(std::move(objects)) {}

std::shared_ptr<LevelSet> LevelCache::find(const wire::GroomHash& groom) {
  std::shared_ptr<LevelSet> levels = read_folder(groom);
  if (!levels) return read_store(groom);
  // A file that another server has put into a shared folder may not be in the store yet.
  if (objects_) objects_->offer(groom);
  return levels;
}

std::shared_ptr<LevelSet> LevelCache::read_store(const wire::GroomHash& groom) {
  if (!objects_) return nullptr;
  const std::optional<std::vector<std::uint8_t>> bytes = objects_->get(groom);
  if (!bytes) return nullptr;
  wire::DecodedLevels decoded = wire::decode_levels(*bytes, groom);
  if (decoded.error != wire::LevelFileError::none) {
    objects_->reject(groom, decoded.detail);
    return nullptr;
  }
  objects_->accept(groom, bytes->size());
  // The folder gets the levels, so that the next use needs no store.
  folder_.put(groom, *bytes);
  return std::move(decoded.levels);
}

std::shared_ptr<LevelSet> LevelCache::read_folder(const wire::GroomHash& groom) {
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
  switch (decoded.error) {
    case wire::LevelFileError::none:
      break;
    case wire::LevelFileError::not_a_level_file:
      count(decoded.detail, groom, counters_->level_cache_rejected_format);
      return nullptr;
    case wire::LevelFileError::other_version:
      count(decoded.detail, groom, counters_->level_cache_rejected_version);
      return nullptr;
    case wire::LevelFileError::other_groom:
      count(decoded.detail, groom, counters_->level_cache_rejected_groom);
      return nullptr;
    case wire::LevelFileError::damaged:
      count(decoded.detail, groom, counters_->level_cache_rejected_damaged);
      return nullptr;
    case wire::LevelFileError::invalid:
      count(decoded.detail, groom, counters_->level_cache_rejected_invalid);
      return nullptr;
  }
  HAIRNET_ASSERT(decoded.levels);
  counters_->level_cache_hits.add();
  // The file was used, so it is removed later than others.
  folder_.touch(groom);
  return std::move(decoded.levels);
}

void LevelCache::put(const wire::GroomHash& groom, const LevelSet& set) {
  if (!folder_.put(groom, wire::encode_levels(groom, set)) || !objects_) return;
  // Levels that were learnt replace those that were built.
  objects_->offer(groom, set.learnt ? ObjectStore::Existing::replace : ObjectStore::Existing::keep);
}

bool LevelCache::put_next() {
  const std::optional<CacheObjects::Wanted> wanted = objects_ ? objects_->take() : std::nullopt;
  if (!wanted) return false;
  // The file may have been damaged or evicted since it was offered. A damaged one must not spread to all servers.
  const CacheFolder::Found file = folder_.read(wanted->groom);
  if (file.outcome == CacheFolder::Outcome::read &&
      wire::decode_levels(file.bytes, wanted->groom).error == wire::LevelFileError::none)
    objects_->put(*wanted, file.bytes);
  else
    objects_->drop();
  return true;
}

void LevelCache::count(const std::string& detail, const wire::GroomHash& groom, Counter& counter) {
  counter.add();
  spdlog::info("event=level_cache_rejected file={} detail={}", log_text(folder_.path_of(groom).string()),
               log_text(detail));
}

}  // namespace hairnet::server
