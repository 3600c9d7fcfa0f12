#include "server/grooms/groom_cache.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "core/assert.hpp"
#include "schema/wire/groom_file.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {

namespace {

// The ending of a groom's file in the folder and in the store.
constexpr const char* kSuffix = ".hngroom";

}  // namespace

CacheObjectsDef GroomCache::objects_def(ObjectCounters& c) {
  return {.suffix = kSuffix,
          .bytes_max = wire::kGroomBytesMax,
          .read = &c.read_groom,
          .absent = &c.absent_groom,
          .stored = &c.stored_groom,
          .kept = &c.kept_groom,
          .rejected = &c.rejected_hash};
}

GroomCache::GroomCache(std::filesystem::path folder, std::uint64_t bytes_max, GroomCacheCounters& counters,
                       std::unique_ptr<CacheObjects> objects)
    : folder_({std::move(folder), kSuffix, bytes_max, wire::kGroomBytesMax, "groom_cache_write_failed", "a groom"},
              counters.groom_cache_written, counters.groom_cache_writes_failed, counters.groom_cache_evicted),
      counters_(&counters),
      objects_(std::move(objects)) {
  refresh();
}

bool GroomCache::is_cached(const wire::GroomHash& groom) const {
  const std::lock_guard lock(mutex_);
  return known_.contains(groom);
}

void GroomCache::refresh() {
  const std::vector<wire::GroomHash> hashes = folder_.hashes();
  std::set<wire::GroomHash> known(hashes.begin(), hashes.end());
  const std::lock_guard lock(mutex_);
  // The folder is listed without the lock, and the old set is freed after it, so the I/O thread waits for a swap only.
  known_.swap(known);
}

GroomCache::Bytes GroomCache::find(const wire::GroomHash& groom) {
  Bytes bytes = read_folder(groom);
  if (!bytes) return read_store(groom);
  // A file that another server has put into a shared folder may not be in the store yet.
  if (objects_) objects_->offer(groom);
  return bytes;
}

GroomCache::Bytes GroomCache::read_folder(const wire::GroomHash& groom) {
  CacheFolder::Found file = folder_.read(groom);
  switch (file.outcome) {
    case CacheFolder::Outcome::read:
      break;
    case CacheFolder::Outcome::absent:
      counters_->groom_cache_misses.add();
      forget(groom);
      return nullptr;
    case CacheFolder::Outcome::unreadable:
      reject("cannot be read", groom, counters_->groom_cache_rejected_unreadable);
      return nullptr;
    case CacheFolder::Outcome::too_large:
      reject("too large", groom, counters_->groom_cache_rejected_damaged);
      return nullptr;
  }
  if (wire::hash_groom(file.bytes) != groom) {
    reject("its bytes are not those of its name", groom, counters_->groom_cache_rejected_damaged);
    return nullptr;
  }
  counters_->groom_cache_hits.add();
  folder_.touch(groom);
  return std::make_shared<const std::vector<std::uint8_t>>(std::move(file.bytes));
}

void GroomCache::put(const wire::GroomHash& groom, std::span<const std::uint8_t> bytes) {
  HAIRNET_VALIDATE(wire::hash_groom(bytes) == groom);
  if (!folder_.put(groom, bytes)) return;
  refresh();
  if (objects_) objects_->offer(groom);
}

GroomCache::Bytes GroomCache::read_store(const wire::GroomHash& groom) {
  if (!objects_) return nullptr;
  std::optional<std::vector<std::uint8_t>> bytes = objects_->get(groom);
  if (!bytes) return nullptr;
  // The store is shared, and other servers write to it: its objects are checked as uploads are.
  if (wire::hash_groom(*bytes) != groom) {
    objects_->reject(groom, "its bytes are not those of its name");
    return nullptr;
  }
  objects_->accept(groom, bytes->size());
  // The folder gets the groom, so that the next use needs no store; a full folder does no harm here.
  if (folder_.put(groom, *bytes)) refresh();
  return std::make_shared<const std::vector<std::uint8_t>>(std::move(*bytes));
}

bool GroomCache::pull(const wire::GroomHash& groom) {
  // The groom is of use only from the folder: the build reads it there.
  return read_store(groom) && is_cached(groom);
}

bool GroomCache::put_next() {
  const std::optional<CacheObjects::Wanted> wanted = objects_ ? objects_->take() : std::nullopt;
  if (!wanted) return false;
  const CacheFolder::Found file = folder_.read(wanted->groom);
  // The folder's file may have been damaged or evicted since it was offered. A damaged one must not spread to all
  // servers.
  if (file.outcome == CacheFolder::Outcome::read && wire::hash_groom(file.bytes) == wanted->groom)
    objects_->put(*wanted, file.bytes);
  else
    objects_->drop();
  return true;
}

void GroomCache::reject(const char* error, const wire::GroomHash& groom, Counter& counter) {
  counter.add();
  spdlog::info("event=groom_cache_rejected file={} detail={}", log_text(folder_.path_of(groom).string()), error);
  folder_.remove(groom);
  forget(groom);
}

void GroomCache::forget(const wire::GroomHash& groom) {
  const std::lock_guard lock(mutex_);
  known_.erase(groom);
}

}  // namespace hairnet::server
