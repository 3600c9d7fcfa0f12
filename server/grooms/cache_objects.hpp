#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "schema/wire/messages.hpp"
#include "server/objects/object_counters.hpp"
#include "server/objects/object_store.hpp"

namespace hairnet::server {

struct CacheObjectsDef {
  // An object's name is the groom's hash and this suffix.
  std::string suffix;
  // Bounds each object.
  std::size_t bytes_max = 0;
  // The counters of this kind of object; all are set.
  Counter *read = nullptr, *absent = nullptr, *stored = nullptr, *kept = nullptr, *rejected = nullptr;
};

// The objects of one cache in the store that servers share: grooms, or levels. A file of the cache's folder that the
// store may lack waits here to be put; only its name waits, and the folder keeps the bytes. Any thread.
class CacheObjects {
 public:
  using Existing = ObjectStore::Existing;

  // `store` and `counters` must outlive this object.
  CacheObjects(CacheObjectsDef def, ObjectStore& store, ObjectCounters& counters);

  // Waits for the store. Nothing when it does not have the object, or gives no answer. The caller checks the bytes, and
  // then accepts or rejects them.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> get(const wire::GroomHash& groom);
  // The bytes are valid: the store is known to have the object.
  void accept(const wire::GroomHash& groom, std::size_t bytes);
  // The bytes are not valid: the next put of this groom replaces the object. Usually a put leaves an object that exists
  // as it is.
  void reject(const wire::GroomHash& groom, const std::string& detail);

  // The folder has a file of this groom. It waits to be put, unless the store is known to have it.
  void offer(const wire::GroomHash& groom, Existing existing = Existing::keep);
  struct Wanted {
    wire::GroomHash groom{};
    Existing existing = Existing::keep;
  };
  // Takes one file that waits to be put, if the store takes puts now.
  [[nodiscard]] std::optional<Wanted> take();
  // Waits for the store. Without an answer the file waits again.
  void put(const Wanted& wanted, std::span<const std::uint8_t> bytes);
  // The file that take() has returned is not put: the folder has no valid file of that groom any more.
  void drop() { counters_->puts_dropped_absent.add(); }
  [[nodiscard]] std::size_t waiting() const;

 private:
  // The name of the groom's object in the store.
  [[nodiscard]] std::string name_of(const wire::GroomHash& groom) const;
  void reject(const wire::GroomHash& groom, const std::string& detail, Counter& counter);
  // The store is known to have a valid object of the groom.
  void note_stored(const wire::GroomHash& groom);

  CacheObjectsDef def_;
  ObjectStore* store_;
  ObjectCounters* counters_;
  // Guards the next three. It is never locked during a call of the store, which may take seconds.
  mutable std::mutex mutex_;
  // The files that wait to be put.
  std::map<wire::GroomHash, Existing> waiting_;
  // The grooms whose objects the store is known to have, so they are not put again.
  std::set<wire::GroomHash> stored_;
  // The grooms whose objects were not valid: their next put replaces the object.
  std::set<wire::GroomHash> rejected_;
};

}  // namespace hairnet::server
