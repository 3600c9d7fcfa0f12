#include "server/room/frame_history.hpp"

#include <algorithm>

#include "core/assert.hpp"

namespace hairnet::server {

codec::FrameIntegers& FrameHistory::add(codec::ErrorClass error_class, std::uint64_t tick, std::uint64_t keep_from) {
  HAIRNET_ASSERT(static_cast<std::size_t>(error_class) < entries_.size());
  HAIRNET_ASSERT(keep_from <= tick);
  HAIRNET_VALIDATE(!find(error_class, tick));
  auto& entries = entries_[static_cast<std::size_t>(error_class)];
  auto place = std::find_if(entries.begin(), entries.end(),
                            [&](const Entry& entry) { return !entry.in_use || entry.tick < keep_from; });
  if (place == entries.end()) place = entries.insert(entries.end(), Entry{});
  place->tick = tick;
  place->in_use = true;
  return place->integers;
}

const codec::FrameIntegers* FrameHistory::find(codec::ErrorClass error_class, std::uint64_t tick) const {
  HAIRNET_ASSERT(static_cast<std::size_t>(error_class) < entries_.size());
  for (const Entry& entry : entries_[static_cast<std::size_t>(error_class)]) {
    if (entry.in_use && entry.tick == tick) return &entry.integers;
  }
  return nullptr;
}

void FrameHistory::clear() {
  for (auto& entries : entries_) {
    for (Entry& entry : entries) entry.in_use = false;
  }
}

}  // namespace hairnet::server
