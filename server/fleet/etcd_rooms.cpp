#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "core/assert.hpp"
#include "schema/limits.hpp"
#include "server/fleet/etcd_directory.hpp"
#include "server/fleet/fleet_values.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

// A new claim waits this long while etcd does not answer.
constexpr std::int64_t kClaimPatience_ns = 10'000'000'000;
// A key of a former lease of ours has this long to vanish.
constexpr std::int64_t kOwnOldKeyWait_ns = 200'000'000;
// The copies of other servers may show a release that much later than ours.
constexpr std::int64_t kCopyLag_ns = 50'000'000;
// The next owner may claim first for this long.
constexpr std::int64_t kHandOver_ns = 5'000'000'000;

}  // namespace

bool EtcdDirectory::claim(std::string_view name, std::int64_t now_ns) {
  if (!wire::is_room_name(name)) {
    counters_->claims_refused_name.add();
    return false;
  }
  if (const auto moved = hand_overs_.find(name); moved != hand_overs_.end()) hand_overs_.erase(moved);
  if (const auto found = rooms_.find(name); found != rooms_.end()) {
    found->second.is_wanted = true;
    return true;
  }
  if (status_.draining || is_stopping_) {
    counters_->claims_refused_draining.add();
    return false;
  }
  if (rooms_.size() >= def_.rooms_max) {
    counters_->claims_refused_full.add();
    return false;
  }
  begin_claim(std::string(name), now_ns + kClaimPatience_ns);
  return true;
}

void EtcdDirectory::begin_claim(const std::string& room, std::int64_t give_up_ns) {
  rooms_.insert_or_assign(room, Room{.give_up_ns = give_up_ns});
  due_.insert(room);
}

void EtcdDirectory::release(std::string_view name, std::int64_t) {
  const auto found = rooms_.find(name);
  if (found == rooms_.end()) return;
  Room& room = found->second;
  room.is_wanted = false;
  if (room.state == Room::State::owned) {
    room.state = Room::State::releasing;
    due_.insert(found->first);
  } else if (room.state == Room::State::claiming && room.call == 0 && !room.is_sent) {
    forget(found->first);
  }
}

void EtcdDirectory::hand_over(std::string_view name, std::uint64_t to, std::int64_t now_ns) {
  const auto found = rooms_.find(name);
  if (found == rooms_.end() || found->second.state != Room::State::owned) return;
  hand_overs_.insert_or_assign(found->first, HandOver{.to = to});
  release(name, now_ns);
}

void EtcdDirectory::poll_hand_overs(std::int64_t now_ns) {
  for (auto next = hand_overs_.begin(); next != hand_overs_.end();) {
    auto& [name, hand_over] = *next;
    const FleetView::Owner* owner = view_.owner(name);
    const bool is_released = !rooms_.contains(name) && !(owner && owner->server_id == status_.id);
    if (is_released && hand_over.released_ns == 0) hand_over.released_ns = now_ns;
    if (is_released && !hand_over.is_told && now_ns - hand_over.released_ns >= kCopyLag_ns) {
      hand_over.is_told = true;
      counters_->rooms_handed_over.add();
      emit({.kind = FleetEvent::Kind::room_handed_over, .room = name, .owner = hand_over.to});
    }
    const bool is_over = hand_over.is_told && now_ns - hand_over.released_ns >= kHandOver_ns;
    next = is_over ? hand_overs_.erase(next) : std::next(next);
  }
}

void EtcdDirectory::poll_rooms(std::int64_t now_ns) {
  std::vector<std::string> vain, vanished;
  for (auto next = due_.begin(); next != due_.end();) {
    const std::string& name = *next;
    Room& room = rooms_.find(name)->second;
    HAIRNET_ASSERT(room.call == 0);
    const bool is_claim = room.state == Room::State::claiming;
    if (is_claim && room.give_up_ns != 0 && now_ns >= room.give_up_ns) {
      vain.push_back(name);
    } else if (!is_claim && lease_ == 0) {
      vanished.push_back(name);  // its key has gone with the lease
    } else if (lease_ != 0 && now_ns >= room.try_at_ns && now_ns >= retry_at_ns_ && calls_.size() < kCallsMax &&
               (is_claim ? fence_.is_open(now_ns) : kept_lease_ != 0 || !kept_due_.contains(name))) {
      const std::string key = keys_.of_room(name);
      room.is_sent |= is_claim;
      const std::string beside = room.skips_kept ? std::string() : keys_.of_kept(name);
      room.call = is_claim
                      ? start(Purpose::claim, etcd::claim(key, owner_value(status_.id), lease_, beside), now_ns, name)
                      : start(Purpose::release, etcd::remove(key, room.claim, kept_of(name, room)), now_ns, name);
      next = due_.erase(next);
      continue;
    }
    ++next;
  }
  for (const std::string& name : vain) give_up(name, now_ns);
  for (const std::string& name : vanished) take_release({.room = name}, now_ns);
}

// A call for a room has ended without an outcome.
void EtcdDirectory::retry_room(const Call& call) {
  if (call.purpose == Purpose::keep) return end_keep(call, false);
  const auto found = rooms_.find(call.room);
  if ((call.purpose != Purpose::claim && call.purpose != Purpose::release) || found == rooms_.end()) return;
  found->second.call = 0;
  due_.insert(call.room);
}

void EtcdDirectory::take_claim(const Call& call, const etcd::TxnAnswer& answer, std::int64_t now_ns) {
  const auto found = rooms_.find(call.room);
  if (found == rooms_.end()) return;
  Room& room = found->second;
  room.call = 0;
  if (call.lease != lease_) {  // the key that was put has vanished
    due_.insert(call.room);
    return;
  }
  const auto entry_at = [&](const std::string& key) {
    const auto entry = std::ranges::find(answer.found, key, &etcd::KeyValue::key);
    return entry == answer.found.end() ? nullptr : &*entry;
  };
  const etcd::KeyValue* kept = entry_at(keys_.of_kept(call.room));
  if (kept && kept->is_too_long) {
    skipped_.add(*kept);
    kept = nullptr;
  }
  if (answer.succeeded) return win(call.room, room, answer.revision, kept);
  const etcd::KeyValue* held = entry_at(keys_.of_room(call.room));
  if (!held) return fail(call, EtcdFault::malformed, now_ns);
  const etcd::KeyValue& existing = *held;
  const std::uint64_t owner = parse_owner(existing.value).value_or(0);
  if (owner == status_.id && existing.lease == lease_) return win(call.room, room, existing.create_revision, kept);
  if (owner == status_.id) {
    room.try_at_ns = now_ns + kOwnOldKeyWait_ns;
    due_.insert(call.room);
    return;
  }
  // The watch tells the end of this entry only if the copy has not come so far yet.
  if (answer.revision > view_.revision) view_.apply({.entry = existing});
  lose_claim(call.room, owner, owner == 0 ? "its entry in etcd is not valid" : "another server owns the room");
}

void EtcdDirectory::lose_claim(const std::string& name, std::uint64_t owner, std::string reason) {
  counters_->claims_lost.add();
  const bool was_ours = rooms_.at(name).give_up_ns == 0;
  if (was_ours) {
    counters_->rooms_lost.add();
    spdlog::warn("event=room_lost room=\"{}\" owner={}", name, id_text(owner));
  }
  emit({.kind = was_ours ? FleetEvent::Kind::room_lost : FleetEvent::Kind::claim_failed,
        .room = name,
        .owner = owner,
        .reason = std::move(reason)});
  forget(name);
}

// Without what is kept of the room its answer is short, unless the room's own entry is too long.
void EtcdDirectory::shorten_claim(const Call& call) {
  const auto found = rooms_.find(call.room);
  if (found == rooms_.end()) return;
  if (found->second.skips_kept) return lose_claim(call.room, 0, "its entry in etcd is too long");
  found->second.skips_kept = true;
  counters_->entries_refused_oversize.add();
  spdlog::warn("event=fleet_entry_skipped key={} reason=oversize", log_text(keys_.of_kept(call.room)));
  retry_room(call);
}

void EtcdDirectory::win(const std::string& name, Room& room, std::int64_t claim, const etcd::KeyValue* kept) {
  counters_->claims.add();
  room.claim = claim;
  room.state = room.is_wanted ? Room::State::owned : Room::State::releasing;
  const bool was_ours = std::exchange(room.give_up_ns, 0) == 0;
  if (!room.is_wanted) {
    due_.insert(name);
    return;
  }
  // A room of ours whose text has vanished has it still: etcd has lost its data, or was away for longer than the lease.
  if (!kept_due_.contains(name) && (kept || !was_ours)) room.kept = kept ? kept->value : std::string();
  room.is_kept = kept || !room.kept.empty();
  room.is_told = false;
  if (!room.kept.empty()) kept_due_.insert(name);  // under a lease of ours: that of its former owner may end
  spdlog::info("event=room_claimed room=\"{}\" claim={}", name, claim);
  emit({.kind = FleetEvent::Kind::room_claimed, .room = name, .claim = claim, .kept = room.kept});
}

void EtcdDirectory::take_release(const Call& call, std::int64_t now_ns) {
  const auto found = rooms_.find(call.room);
  if (found == rooms_.end()) return;
  const bool is_wanted = found->second.is_wanted;
  counters_->rooms_released.add();
  forget(call.room);
  if (is_wanted) begin_claim(call.room, now_ns + kClaimPatience_ns);
}

// A new claim has had no outcome for too long. etcd may still execute one that is on its way: check_room sees that.
void EtcdDirectory::give_up(const std::string& room, std::int64_t) {
  counters_->claims_refused_unreachable.add();
  emit({.kind = FleetEvent::Kind::claim_failed, .room = room, .reason = "etcd does not answer"});
  forget(room);
  check_room(room, view_.revision);
}

void EtcdDirectory::forget(const std::string& room) {
  const auto held = rooms_.extract(room);  // and not erased: `room` may be its key
  due_.erase(room);
  kept_due_.erase(room);
}

// The copy has got news of a room at this revision.
void EtcdDirectory::check_room(const std::string& name, std::int64_t revision) {
  const FleetView::Owner* owner = view_.owner(name);
  const auto found = rooms_.find(name);
  if (found == rooms_.end()) {
    // A claim of ours that was given up, and executed later.
    const bool is_orphan = owner && owner->server_id == status_.id && lease_ != 0 && owner->lease == lease_;
    if (!is_orphan) return;
    rooms_.emplace(name, Room{.state = Room::State::releasing, .claim = owner->claim, .is_wanted = false});
    due_.insert(name);
    return;
  }
  Room& room = found->second;
  if (room.state != Room::State::owned || revision <= room.claim || (owner && owner->claim == room.claim)) return;
  // Our key has vanished: with the lease, or an operator has deleted it. A claim finds out.
  room.state = Room::State::claiming;
  room.give_up_ns = 0;
  room.is_sent = false;
  due_.insert(name);
}

}  // namespace hairnet::server
