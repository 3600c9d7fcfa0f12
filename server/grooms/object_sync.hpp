#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <set>

#include "schema/wire/messages.hpp"
#include "server/grooms/groom_cache.hpp"
#include "server/grooms/level_cache.hpp"
#include "server/objects/object_counters.hpp"
#include "server/objects/object_store.hpp"
#include "server/threading/bounded_queue.hpp"

namespace hairnet::server {

// Brings grooms from the object store to the folder of the groom cache when a session offers them, and files of both
// caches to the store. It has a thread of its own, since it waits for the store: builds and joins do not wait for it.
// The I/O thread asks and takes results.
class ObjectSync {
 public:
  // A cache may be null; otherwise it uses this store. The caches, the store and the counters must outlive this object.
  ObjectSync(GroomCache* grooms, LevelCache* levels, ObjectStore& store, ObjectCounters& counters);

  struct Found {
    wire::GroomHash groom{};
    // The folder of the groom cache has it now.
    bool is_cached = false;
  };
  // Looks for the groom, unless that is under way. Returns false when that cannot be now: the store is left alone after
  // a failure, or too many grooms wait. I/O thread.
  bool find(const wire::GroomHash& groom);
  // Takes the next result. False when there is none. I/O thread.
  bool take(Found& found);
  // Files may wait to be put.
  void wake() const;

  // Does one thing, on its thread. False when there was none.
  bool poll();
  // Ends the call under way soon, and every later one at once. Any thread.
  void cancel() { store_->cancel(); }

  // on_job wakes the objects thread, on_result the I/O thread. Set them before use.
  std::function<void()> on_job, on_result;

 private:
  // Do one search, or one put. Return false when there was none.
  bool poll_find();
  bool poll_put();

  GroomCache* grooms_;
  LevelCache* levels_;
  ObjectStore* store_;
  ObjectCounters* counters_;
  // The grooms that the objects thread looks for. When the queue is full, find() returns false.
  BoundedQueue<wire::GroomHash> wanted_;
  // The results, one for each groom that was in wanted_.
  BoundedQueue<Found> found_;
  // The grooms that find() was asked for and whose result was not taken. I/O thread.
  std::set<wire::GroomHash> under_way_;
};

}  // namespace hairnet::server
