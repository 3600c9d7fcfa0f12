#include "server/grooms/object_sync.hpp"

#include <new>

#include "server/threading/memory_reserve.hpp"

namespace hairnet::server {
namespace {

// With more at once, a slow store would delay uploads that could have begun: beyond it the session is asked for the
// bytes.
constexpr std::size_t kWantedMax = 64;

}  // namespace

ObjectSync::ObjectSync(GroomCache* grooms, LevelCache* levels, ObjectStore& store, ObjectCounters& counters)
    : grooms_(grooms), levels_(levels), store_(&store), counters_(&counters), wanted_(kWantedMax), found_(0) {}

bool ObjectSync::find(const wire::GroomHash& groom) {
  // Several sessions may offer the groom while it is looked for: one answer serves all.
  if (under_way_.contains(groom)) return true;
  if (!grooms_ || !store_->takes_gets()) return false;
  wire::GroomHash item = groom;
  if (!wanted_.try_put(item)) {
    counters_->finds_skipped.add();
    return false;
  }
  under_way_.insert(groom);
  wake();
  return true;
}

bool ObjectSync::take(Found& found) {
  if (!found_.take(found)) return false;
  under_way_.erase(found.groom);
  return true;
}

void ObjectSync::wake() const {
  if (on_job) on_job();
}

bool ObjectSync::poll() {
  try {
    const MemoryReserve::MayFail may_fail;
    // Lookups come first, because a client waits for them; nobody waits for a put.
    return poll_find() || poll_put();
  } catch (const std::bad_alloc&) {
    return false;
  }
}

bool ObjectSync::poll_find() {
  Found found;
  if (!wanted_.take(found.groom)) return false;
  try {
    found.is_cached = grooms_->pull(found.groom);
  } catch (const std::bad_alloc&) {
    // The I/O thread waits for an answer to each find(), so it gets one even now.
    found.is_cached = false;
  }
  found_.put(found);
  if (on_result) on_result();
  return true;
}

// Levels first: who finds the groom in the store shall find its levels.
bool ObjectSync::poll_put() {
  const bool has_put = (levels_ && levels_->put_next()) || (grooms_ && grooms_->put_next());
  const std::size_t waiting = (levels_ ? levels_->waiting_puts() : 0) + (grooms_ ? grooms_->waiting_puts() : 0);
  counters_->gauges.puts_waiting.set(static_cast<double>(waiting));
  return has_put;
}

}  // namespace hairnet::server
