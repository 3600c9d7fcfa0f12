#include <algorithm>
#include <map>
#include <utility>

#include "core/assert.hpp"
#include "server/grooms/groom_store.hpp"

// The builds of GroomStore: which groom is next, and for how long.
namespace hairnet::server {

void GroomStore::queue(Entry& entry, SessionId owner) {
  entry.state = State::queued;
  entry.owner = owner;
  entry.order = ++orders_;
}

void GroomStore::feed_builder() {
  if (is_builder_busy_) return;
  const auto next = next_to_build();
  if (next == grooms_.end()) return;
  is_builder_busy_ = true;
  next->second.job = ++jobs_;
  builder_->put({jobs_, next->first, std::exchange(next->second.chunks, {}), next->second.bytes});
}

void GroomStore::prepare(std::span<const wire::GroomHash> grooms, std::int64_t now_ns) {
  for (const wire::GroomHash& hash : grooms) {
    const bool waits = std::ranges::find(to_prepare_, hash) != to_prepare_.end();
    if (!waits && !grooms_.contains(hash) && to_prepare_.size() < limits_.groom_count_max) to_prepare_.push_back(hash);
  }
  queue_prepared(now_ns);
}

// One of them, when the builder has nothing else to do.
void GroomStore::queue_prepared(std::int64_t now_ns) {
  while (!to_prepare_.empty() && !is_builder_busy_ && next_to_build() == grooms_.end()) {
    const wire::GroomHash hash = to_prepare_.front();
    to_prepare_.pop_front();
    if (grooms_.contains(hash)) continue;
    if (grooms_.size() >= limits_.groom_count_max && !evict_one()) continue;
    const auto groom = grooms_.try_emplace(hash).first;
    groom->second.used = ++uses_;
    if (!objects_ || builder_->is_cached(hash))
      queue(groom->second, 0);  // another server may have put it into the folder since that was listed
    else if (!search(groom, now_ns))
      erase(groom);
    feed_builder();
  }
}

GroomStore::Turn GroomStore::turn_of(const Entry& entry) const {
  const auto taken = build_ns_.find(sharer_of(entry.owner));
  return {!accounts_.contains(entry.owner), taken == build_ns_.end() ? 0 : taken->second, entry.order};
}

GroomStore::Grooms::iterator GroomStore::next_to_build() {
  auto next = grooms_.end();
  for (auto groom = grooms_.begin(); groom != grooms_.end(); ++groom) {
    if (groom->second.state != State::queued || groom->second.job != 0 || groom->second.build_again_ns > now_ns_)
      continue;
    if (next == grooms_.end() || turn_of(groom->second) < turn_of(next->second)) next = groom;
  }
  return next;
}

void GroomStore::charge(Entry& entry, std::int64_t build_ns) {
  if (build_ns <= entry.charged_ns || !accounts_.contains(entry.owner)) return;
  build_ns_[sharer_of(entry.owner)] += build_ns - entry.charged_ns;
  entry.charged_ns = build_ns;
}

void GroomStore::end_turn(std::int64_t now_ns) {
  const auto built = std::ranges::find(grooms_, State::building, [](const auto& g) { return g.second.state; });
  if (built == grooms_.end() || built->second.gives_way) return;
  Entry& entry = built->second;
  const std::int64_t taken_ns = now_ns - entry.built_since_ns;
  if (taken_ns < entry.turn_ns) return;
  charge(entry, taken_ns);
  const auto next = next_to_build();
  if (next == grooms_.end() || turn_of(next->second) >= turn_of(entry)) return;
  entry.gives_way = true;
  builder_->drop(entry.job);
}

Refused GroomStore::make_place_in_queue(SessionId session, std::int64_t now_ns) {
  const auto waits_with_bytes = [](const Entry& entry) {
    return entry.state == State::queued && entry.job == 0 && (!entry.chunks.empty() || entry.bytes);
  };
  std::map<Sharer, std::size_t> waiting;
  std::size_t count = 0;
  for (const auto& [hash, entry] : grooms_) {
    if (!waits_with_bytes(entry)) continue;
    ++waiting[sharer_of(entry.owner)];
    ++count;
  }
  if (count < limits_.build_queue_max) return {};
  const Refused refused{wire::ErrorReason::groom_build_queue_full, "too many grooms wait to be built; try again"};
  counters_->grooms_refused_queue_full.add();
  const auto most = std::ranges::max_element(waiting, {}, [](const auto& w) { return w.second; });
  if (most == waiting.end() || most->second <= waiting[sharer_of(session)] + 1) return refused;
  // The newest of who has most.
  auto lost = grooms_.end();
  for (auto groom = grooms_.begin(); groom != grooms_.end(); ++groom) {
    const Entry& entry = groom->second;
    if (!waits_with_bytes(entry) || sharer_of(entry.owner) != most->first) continue;
    if (lost == grooms_.end() || entry.order > lost->second.order) lost = groom;
  }
  HAIRNET_ASSERT(lost != grooms_.end());
  const auto users = lost->second.users;
  for (const auto& [user, its] : users) refuse_user(lost, user, refused, now_ns);
  erase(lost);
  return {};
}

}  // namespace hairnet::server
