#include "server/fleet/etcd_rooms.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "core/assert.hpp"
#include "schema/limits.hpp"
#include "server/fleet/fleet_values.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

// A claim of a new room is given up after this time without an outcome. A Hello usually waits less for the room: as
// long as a handshake may take (SessionLimits::handshake_timeout_ns, 5 s).
constexpr std::int64_t kClaimPatience_ns = 10'000'000'000;
// A claim that has found a key of a former lease of this server is tried again after this time: etcd removes the key
// when it ends that lease.
constexpr std::int64_t kOwnOldKeyWait_ns = 200'000'000;
// The copies of other servers may show a release this much later than the own copy. A client that is sent to the next
// owner before would be sent back.
constexpr std::int64_t kCopyLag_ns = 50'000'000;
// After a hand-over, clients that ask for the room are sent to its next owner for this time, so that this server is the
// first to claim the room. Placement alone might choose another server, or this one again.
constexpr std::int64_t kHandOver_ns = 5'000'000'000;

}  // namespace

EtcdRooms::EtcdRooms(const EtcdDirectoryDef& def, EtcdCalls& calls, EtcdLease& lease, const EtcdEntry& entry,
                     EtcdCopy& copy, FleetCounters& counters, std::function<void(FleetEvent)> emit)
    : def_(&def),
      calls_(&calls),
      lease_(&lease),
      entry_(&entry),
      copy_(&copy),
      counters_(&counters),
      emit_(std::move(emit)),
      keys_(def.fleet),
      kept_(keys_, calls, counters) {}

Placement EtcdRooms::where(std::string_view name, std::int64_t now_ns) const {
  using Kind = Placement::Kind;
  const ServerStatus& self = entry_->status();
  if (const auto own = rooms_.find(name); own != rooms_.end()) {
    const Room& room = own->second;
    if (room.state != Room::State::owned) return {.kind = Kind::pending};
    // No client enters before the room's text, such as its bans, is in force.
    if (!room.is_announced) return {.kind = Kind::pending, .server_id = self.id, .claim = room.claim};
    if (lease_->is_open(now_ns))
      return {.kind = Kind::here, .server_id = self.id, .address = self.address, .claim = room.claim};
    return {.kind = Kind::unavailable, .claim = room.claim, .reason = "the lease has run out: etcd does not answer"};
  }
  const FleetView& view = copy_->view();
  const FleetView::Owner* owner = view.owner(name);
  if (owner && owner->server_id != self.id) {
    // The copy may have a room and not yet its owner's entry, for example its address: the keys of rooms come before
    // those of servers.
    const ServerStatus* server = view.server(owner->server_id);
    if (!server) return {.kind = Kind::pending, .server_id = owner->server_id, .claim = owner->claim};
    return {.kind = Kind::elsewhere, .server_id = server->id, .address = server->address, .claim = owner->claim};
  }
  const auto hand_over = hand_overs_.find(name);
  const bool is_handed_over = hand_over != hand_overs_.end();
  // The own copy still shows the room as this server's. Other servers then may not know of the release either, and
  // would send a client back here.
  if (owner && (self.draining || is_handed_over)) return {.kind = Kind::pending};
  if (is_handed_over) {
    if (!hand_over->second.is_announced) return {.kind = Kind::pending};
    const ServerStatus* to = view.server(hand_over->second.to);
    if (to && !to->draining) return {.kind = Kind::elsewhere, .server_id = to->id, .address = to->address};
  }
  if (!calls_->is_reachable()) return {.kind = Kind::unavailable, .reason = "etcd does not answer"};
  return {.kind = copy_->is_listed() ? Kind::unowned : Kind::pending};
}

bool EtcdRooms::claim(std::string_view name, std::int64_t now_ns) {
  if (!wire::is_room_name(name)) {
    counters_->claims_refused_name.add();
    return false;
  }
  // A claim ends a hand-over, because the room shall be on this server.
  if (const auto moved = hand_overs_.find(name); moved != hand_overs_.end()) hand_overs_.erase(moved);
  if (const auto found = rooms_.find(name); found != rooms_.end()) {
    // A room that is being released is claimed again after that: the release under way cannot be called back.
    found->second.is_wanted = true;
    return true;
  }
  if (entry_->status().draining || lease_->is_ending()) {
    counters_->claims_refused_draining.add();
    return false;
  }
  if (rooms_.size() >= def_->rooms_max) {
    counters_->claims_refused_full.add();
    return false;
  }
  add(std::string(name), {.give_up_ns = now_ns + kClaimPatience_ns});
  return true;
}

void EtcdRooms::release(std::string_view name) {
  const auto found = rooms_.find(name);
  if (found == rooms_.end()) return;
  Room& room = found->second;
  room.is_wanted = false;
  if (room.state == Room::State::owned) {
    room.state = Room::State::releasing;
    due_.insert(found->first);
  } else if (room.state == Room::State::claiming && room.call == 0 && !room.is_sent) {
    // A claim that etcd may have executed stays until its outcome is known. If it were forgotten, this server could own
    // a room in etcd that no server steps.
    forget(found->first);
  }
}

void EtcdRooms::hand_over(std::string_view name, std::uint64_t to) {
  const auto found = rooms_.find(name);
  if (found == rooms_.end() || found->second.state != Room::State::owned) return;
  hand_overs_.insert_or_assign(found->first, HandOver{.to = to});
  release(name);
}

void EtcdRooms::keep(std::string_view name, std::string text) {
  const auto found = rooms_.find(name);
  // The release carries the last text; a later one would miss it.
  if (found == rooms_.end() || found->second.state == Room::State::releasing) return;
  kept_.put(found->first, std::move(text));
}

std::vector<std::string> EtcdRooms::owned() const {
  std::vector<std::string> owned;
  for (const auto& [name, room] : rooms_)
    if (room.state == Room::State::owned) owned.push_back(name);
  return owned;
}

std::int64_t EtcdRooms::claim_of(std::string_view name) const {
  const auto found = rooms_.find(name);
  return found != rooms_.end() && found->second.state == Room::State::owned ? found->second.claim : 0;
}

void EtcdRooms::on_announced(std::string_view name) {
  if (const auto found = rooms_.find(name); found != rooms_.end()) found->second.is_announced = true;
}

void EtcdRooms::on_lease_lost() {
  for (auto& [name, room] : rooms_) {
    room.is_sent = false;
    if (room.state != Room::State::owned) continue;
    room.is_wanted = true;
    claim_again(name, room);
  }
}

void EtcdRooms::check(const std::string& name, std::int64_t revision) {
  const FleetView::Owner* owner = copy_->view().owner(name);
  const auto found = rooms_.find(name);
  if (found == rooms_.end()) {
    // The key is of a claim of this server that was given up, and that etcd has executed later. The room is released:
    // otherwise clients would be sent here, and no server would step the room.
    const bool is_orphan =
        owner && owner->server_id == def_->server_id && lease_->id() != 0 && owner->lease == lease_->id();
    if (is_orphan) add(name, {.state = Room::State::releasing, .claim = owner->claim, .is_wanted = false});
    return;
  }
  Room& room = found->second;
  // A change that is older than this server's claim is about an earlier owner.
  if (room.state != Room::State::owned || revision <= room.claim || (owner && owner->claim == room.claim)) return;
  // This server's key has vanished, with the lease or because an operator has deleted it. A new claim finds out which
  // server owns the room.
  claim_again(name, room);
}

void EtcdRooms::check_all() {
  const FleetView& view = copy_->view();
  for (const auto& [name, owner] : view.rooms())
    if (owner.server_id == def_->server_id) check(name, view.revision);
  // check() may add and change rooms, so the names are gathered before.
  std::vector<std::string> own;
  for (const auto& [name, room] : rooms_) own.push_back(name);
  for (const std::string& name : own) check(name, view.revision);
}

void EtcdRooms::clear() {
  rooms_.clear();
  due_.clear();
  kept_.clear();
  hand_overs_.clear();
}

void EtcdRooms::poll(std::int64_t now_ns) {
  poll_rooms(now_ns);
  poll_hand_overs(now_ns);
  if (lease_->is_open(now_ns) && calls_->may_start(now_ns))
    kept_.poll([this](const std::string& name) { return claim_of(name); }, now_ns);
}

void EtcdRooms::poll_rooms(std::int64_t now_ns) {
  std::vector<std::string> vain, vanished;
  for (auto next = due_.begin(); next != due_.end();) {
    const std::string& name = *next;
    Room& room = rooms_.find(name)->second;
    HAIRNET_ASSERT(room.call == 0);
    const bool is_claim = room.state == Room::State::claiming;
    // A room that this server owned before has no such time (Room::give_up_ns).
    if (is_claim && room.give_up_ns != 0 && now_ns >= room.give_up_ns) {
      vain.push_back(name);
    } else if (!is_claim && lease_->id() == 0) {
      // The room's key has gone with the lease, so the release has nothing to do.
      vanished.push_back(name);
    } else if (lease_->id() != 0 && now_ns >= room.try_at_ns && calls_->may_start(now_ns) && !calls_->is_full() &&
               (is_claim ? lease_->is_open(now_ns) : kept_.may_release(name))) {
      // No claim is sent behind a closed fence: it would win a room that nobody steps.
      room.is_sent |= is_claim;
      room.call = is_claim ? send_claim(name, room, now_ns) : send_release(name, room, now_ns);
      next = due_.erase(next);
      continue;
    }
    ++next;
  }
  // give_up() and take_release() change due_, so they come after the loop.
  for (const std::string& name : vain) give_up(name);
  for (const std::string& name : vanished) take_release(name, now_ns);
}

void EtcdRooms::poll_hand_overs(std::int64_t now_ns) {
  for (auto next = hand_overs_.begin(); next != hand_overs_.end();) {
    auto& [name, hand_over] = *next;
    const FleetView::Owner* owner = copy_->view().owner(name);
    // The release counts only when etcd has confirmed it and the own copy shows it.
    const bool is_released = !rooms_.contains(name) && !(owner && owner->server_id == def_->server_id);
    if (is_released && hand_over.released_ns == 0) hand_over.released_ns = now_ns;
    if (is_released && !hand_over.is_announced && now_ns - hand_over.released_ns >= kCopyLag_ns) {
      hand_over.is_announced = true;
      counters_->rooms_handed_over.add();
      emit_({.kind = FleetEvent::Kind::room_handed_over, .room = name, .owner = hand_over.to});
    }
    const bool is_over = hand_over.is_announced && now_ns - hand_over.released_ns >= kHandOver_ns;
    next = is_over ? hand_overs_.erase(next) : std::next(next);
  }
}

std::uint64_t EtcdRooms::send_claim(const std::string& name, const Room& room, std::int64_t now_ns) {
  const std::int64_t lease = lease_->id();
  const std::string beside = room.skips_kept ? std::string() : keys_.of_kept(name);
  const auto take = [this, name, lease](const auto& answer, auto at_ns) {
    return take_claim(name, lease, answer, at_ns);
  };
  const auto note_failure = [this, name](auto error, auto) {
    return error == EtcdError::oversize ? shorten_claim(name) : retry(name);
  };
  const auto lose_lease = [this, name, lease](auto at_ns) {
    retry(name);
    lease_->lose(lease, at_ns);
  };
  return calls_->start({.request = etcd::claim(keys_.of_room(name), owner_value(def_->server_id), lease, beside),
                        .on_answer = calls_->reading(etcd::parse_txn, take),
                        .on_failure = note_failure,
                        .on_lease_gone = lose_lease},
                       now_ns);
}

std::uint64_t EtcdRooms::send_release(const std::string& name, const Room& room, std::int64_t now_ns) {
  const auto take = [this, name](const auto&, auto at_ns) { take_release(name, at_ns); };
  // A release needs no lease itself, but the text that it puts beside needs that of the texts.
  const auto lose_kept_lease = [this, name](auto) {
    retry(name);
    kept_.lose_lease();
  };
  return calls_->start({.request = etcd::remove(keys_.of_room(name), room.claim, kept_.beside_release(name)),
                        .on_answer = calls_->reading(etcd::parse_txn, take),
                        .on_failure = [this, name](auto, auto) { retry(name); },
                        .on_lease_gone = lose_kept_lease},
                       now_ns);
}

// A call for a room has ended without an outcome.
void EtcdRooms::retry(const std::string& name) {
  const auto found = rooms_.find(name);
  if (found == rooms_.end()) return;
  found->second.call = 0;
  due_.insert(name);
}

void EtcdRooms::claim_again(const std::string& name, Room& room) {
  room.state = Room::State::claiming;
  room.give_up_ns = 0;
  room.is_sent = false;
  due_.insert(name);
}

// Takes the answer to a claim under `lease`. Returns false when the claim has failed and the answer lacks the room's
// entry.
bool EtcdRooms::take_claim(const std::string& name, std::int64_t lease, const etcd::TxnAnswer& answer,
                           std::int64_t now_ns) {
  const auto own = rooms_.find(name);
  if (own == rooms_.end()) return true;
  Room& room = own->second;
  room.call = 0;
  // The key that the claim may have put has vanished with that lease, so the claim is sent again under the new one.
  if (lease != lease_->id()) {
    due_.insert(name);
    return true;
  }
  const auto entry_at = [&](const std::string& key) {
    const auto entry = std::ranges::find(answer.found, key, &etcd::KeyValue::key);
    return entry == answer.found.end() ? nullptr : &*entry;
  };
  const etcd::KeyValue* kept = entry_at(keys_.of_kept(name));
  if (kept && kept->is_too_long) {
    copy_->skip(*kept);
    kept = nullptr;
  }
  if (answer.succeeded) {
    win(name, room, answer.revision, kept);
    return true;
  }
  const etcd::KeyValue* existing = entry_at(keys_.of_room(name));
  if (!existing) return false;
  const std::uint64_t owner = parse_owner(existing->value).value_or(0);
  // An earlier try of this claim was executed, and its answer got lost.
  if (owner == def_->server_id && existing->lease == lease) {
    win(name, room, existing->create_revision, kept);
  } else if (owner == def_->server_id) {
    // The key is of a former lease of this server; it vanishes when etcd ends that lease.
    room.try_at_ns = now_ns + kOwnOldKeyWait_ns;
    due_.insert(name);
  } else {
    // The copy may be older than this answer. With the entry it can tell clients the owner at once.
    copy_->learn(*existing, answer.revision);
    lose(name, owner, owner == 0 ? "its entry in etcd is not valid" : "another server owns the room");
  }
  return true;
}

void EtcdRooms::win(const std::string& name, Room& room, std::int64_t claim, const etcd::KeyValue* kept) {
  counters_->claims.add();
  room.claim = claim;
  room.state = room.is_wanted ? Room::State::owned : Room::State::releasing;
  const bool was_ours = std::exchange(room.give_up_ns, 0) == 0;
  // The room was released while the claim was under way.
  if (!room.is_wanted) {
    due_.insert(name);
    return;
  }
  // Clients may enter only when the server has taken the event, and with it the room's text (on_announced).
  room.is_announced = false;
  const std::string& text = kept_.take(name, kept, was_ours);
  spdlog::info("event=room_claimed room=\"{}\" claim={}", name, claim);
  emit_({.kind = FleetEvent::Kind::room_claimed, .room = name, .claim = claim, .kept = text});
}

void EtcdRooms::lose(const std::string& name, std::uint64_t owner, std::string reason) {
  counters_->claims_lost.add();
  const bool was_ours = rooms_.at(name).give_up_ns == 0;
  if (was_ours) {
    counters_->rooms_lost.add();
    spdlog::warn("event=room_lost room=\"{}\" owner={}", name, id_text(owner));
  }
  emit_({.kind = was_ours ? FleetEvent::Kind::room_lost : FleetEvent::Kind::claim_failed,
         .room = name,
         .owner = owner,
         .reason = std::move(reason)});
  forget(name);
}

// The answer to the claim was too long. Without the room's text it is short, unless the room's own entry is too long,
// too.
void EtcdRooms::shorten_claim(const std::string& name) {
  const auto found = rooms_.find(name);
  if (found == rooms_.end()) return;
  if (found->second.skips_kept) return lose(name, 0, "its entry in etcd is too long");
  found->second.skips_kept = true;
  counters_->entries_refused_oversize.add();
  spdlog::warn("event=fleet_entry_skipped key={} reason=oversize", log_text(keys_.of_kept(name)));
  retry(name);
}

void EtcdRooms::take_release(const std::string& name, std::int64_t now_ns) {
  const auto found = rooms_.find(name);
  if (found == rooms_.end()) return;
  const bool is_wanted = found->second.is_wanted;
  counters_->rooms_released.add();
  forget(name);
  // Somebody has asked for the room while it was being released.
  if (is_wanted) add(name, {.give_up_ns = now_ns + kClaimPatience_ns});
}

// The claim of a new room has had no outcome for kClaimPatience_ns. etcd may still execute it; check() then finds and
// releases the room.
void EtcdRooms::give_up(const std::string& name) {
  counters_->claims_refused_unreachable.add();
  emit_({.kind = FleetEvent::Kind::claim_failed, .room = name, .reason = "etcd does not answer"});
  forget(name);
  check(name, copy_->view().revision);
}

void EtcdRooms::add(const std::string& name, const Room& room) {
  rooms_.insert_or_assign(name, room);
  kept_.add(name);
  due_.insert(name);
}

void EtcdRooms::forget(const std::string& name) {
  // The node lives to the end of the function, because `name` may be its key.
  const auto held = rooms_.extract(name);
  due_.erase(name);
  kept_.forget(name);
}

}  // namespace hairnet::server
