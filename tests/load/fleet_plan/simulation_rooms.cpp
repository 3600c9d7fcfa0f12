#include <algorithm>
#include <cmath>
#include <utility>

#include "core/assert.hpp"
#include "server/fleet/choose_server.hpp"
#include "tests/load/fleet_plan/simulation.hpp"

namespace hairnet::fleet_plan {
namespace {

// An empty room keeps its owner so long: the default of Config::room_grace_ns.
constexpr std::int64_t kRoomGrace_s = 10;
// A server that hands a room over waits so long before it sends the clients on, so that the other servers know of the
// release: kCopyLag_ns in server/fleet/etcd_rooms.cpp.
constexpr double kCopyLag_s = 0.05;

}  // namespace

// Lets the servers' placement choose a server, which then claims the room. Returns false when no server takes rooms.
// It also returns false when the chosen server is dead: the room is then away until the end of that server's lease,
// since the others do not know of the death earlier.
bool Simulation::place(RoomId room_id) {
  const auto chosen = server::choose_server(room_names_[room_id], statuses_);
  if (!chosen) return false;
  const auto slot = static_cast<ServerSlot>(*chosen & kSlotMask);
  if (servers_[slot].state != Server::State::ready) {
    rooms_[room_id].state = Room::State::away;
    rooms_[room_id].try_at_s = std::max(now_s_ + 1, servers_[slot].lease_ends_s);
    return false;
  }
  own(room_id, slot);
  return true;
}

void Simulation::own(RoomId room_id, ServerSlot slot) {
  Room& room = rooms_[room_id];
  Server& server = servers_[slot];
  HAIRNET_ASSERT(room.owner == kNone);
  room.state = Room::State::owned;
  room.owner = slot;
  room.since_s = now_s_;
  room.place = static_cast<std::uint32_t>(server.rooms.size());
  server.rooms.push_back(room_id);
  server.people += static_cast<std::uint32_t>(room.members.size());
  server.cpu_s += room.cpu_s;
  cpu_s_ += room.cpu_s;
  bytes_per_s_ += room.bytes_per_s;
  write(EtcdWrite::claim);
  // The rest is statistics of a move, which has interrupted the frames of members.
  const double since_s = std::exchange(room.away_since_s, -1);
  if (since_s < 0) return;
  const auto cause = static_cast<std::size_t>(room.cause);
  const ServerCosts& costs = settings_.costs;
  const double outage_s = static_cast<double>(now_s_) - since_s + (costs.claim_ms + costs.redirect_ms) / 1e3 +
                          (room.cause == MoveCause::balance ? kCopyLag_s : 0);
  outcome_.room_outage[cause].record(std::llround(outage_s * 1e9));
  ++outcome_.rooms_moved[cause];
  ++interval_.rooms_moved[cause];
  for (const PersonId id : room.members) {
    ++outcome_.people_moved[cause];
    const double away_s = outage_s + costs.connect_s() + level_wait_s(server, people_[id].hairstyle);
    outcome_.hair_away[cause].record(std::llround(away_s * 1e9));
  }
}

// Removes the room from its owner's list, because etcd has no key of it any more.
void Simulation::disown(RoomId room_id) {
  Room& room = rooms_[room_id];
  Server& server = servers_[room.owner];
  const RoomId last = server.rooms.back();
  server.rooms[room.place] = last;
  rooms_[last].place = room.place;
  server.rooms.pop_back();
  room.owner = kNone;
}

// The owner stops sending frames. Its key stays in etcd until disown(). The room looks for a server from `try_at_s` on.
void Simulation::stop_serving(RoomId room_id, MoveCause cause, std::int64_t try_at_s) {
  Room& room = rooms_[room_id];
  Server& server = servers_[room.owner];
  server.people -= static_cast<std::uint32_t>(room.members.size());
  server.cpu_s -= room.cpu_s;
  cpu_s_ -= room.cpu_s;
  bytes_per_s_ -= room.bytes_per_s;
  room.state = Room::State::away;
  room.try_at_s = try_at_s;
  room.cause = cause;
  if (!room.members.empty()) room.away_since_s = static_cast<double>(now_s_);
  set_pending(room_id);
}

// Hands the room over to server `to`. If that server is dead, it claims nothing, and placement decides later
// (take_pending).
void Simulation::move_room(RoomId room, ServerSlot to) {
  stop_serving(room, MoveCause::balance, now_s_);
  disown(room);
  write(EtcdWrite::release);
  if (servers_[to].state == Server::State::ready) own(room, to);
}

// Computes the room's load again after members have come or gone, and corrects the sums of its owner and of the fleet.
void Simulation::update_load(RoomId room_id) {
  Room& room = rooms_[room_id];
  const auto members = static_cast<double>(room.members.size());
  const double observed = std::min(members, static_cast<double>(settings_.observe));
  const double cpu_s = members > 0 ? members * settings_.costs.cpu_s(settings_.level, observed) : 0;
  const double bytes_per_s = members > 0 ? members * settings_.costs.bytes_per_s(settings_.level, observed) : 0;
  if (room.state == Room::State::owned) {
    servers_[room.owner].cpu_s += cpu_s - room.cpu_s;
    cpu_s_ += cpu_s - room.cpu_s;
    bytes_per_s_ += bytes_per_s - room.bytes_per_s;
  }
  const bool was_overloaded = room.cpu_s > settings_.capacity(), is_overloaded = cpu_s > settings_.capacity();
  if (is_overloaded && !was_overloaded) ++overloaded_now_;
  if (!is_overloaded && was_overloaded) --overloaded_now_;
  if (is_overloaded && !std::exchange(room.has_been_overloaded, true)) ++outcome_.rooms_overloaded;
  room.cpu_s = cpu_s;
  room.bytes_per_s = bytes_per_s;
  outcome_.room_people_max = std::max(outcome_.room_people_max, members);
  outcome_.room_cpu_s_max = std::max(outcome_.room_cpu_s_max, cpu_s);
  outcome_.room_bytes_per_s_max = std::max(outcome_.room_bytes_per_s_max, bytes_per_s);
}

void Simulation::set_pending(RoomId room_id) {
  if (!std::exchange(rooms_[room_id].is_pending, true)) pending_.push_back(room_id);
}

// Looks for servers for rooms that are away, and admits people who wait, in the order of their arrival. Those who have
// waited for Settings::patience_s leave.
void Simulation::take_pending() {
  std::vector<RoomId> later;
  for (const RoomId room_id : std::exchange(pending_, {})) {
    Room& room = rooms_[room_id];
    room.is_pending = false;
    if (room.state == Room::State::away && now_s_ >= room.try_at_s && room.owner == kNone) {
      if (room.members.empty()) room.away_since_s = -1;
      if (room.members.empty() && room.waiting.empty()) {
        room.state = Room::State::unowned;
        continue;
      }
      if (!place(room_id)) room.try_at_s = std::max(room.try_at_s, now_s_ + 1);
    }
    std::vector<PersonId> waiting;
    for (const PersonId id : std::exchange(room.waiting, {})) {
      // Somebody in `waiting` has waited longer than this person, and must be admitted first.
      if (room.state == Room::State::owned && waiting.empty() && !is_full(servers_[room.owner])) {
        --waiting_count_;
        admit(room_id, id, settings_.costs.claim_ms / 1e3);
      } else if (static_cast<double>(now_s_ - people_[id].since_s) >= settings_.patience_s) {
        --waiting_count_;
        ++outcome_.turned_away_no_server;
        remove_person(id);
      } else {
        waiting.push_back(id);
      }
    }
    room.waiting = std::move(waiting);
    if (room.state == Room::State::away || !room.waiting.empty()) {
      room.is_pending = true;
      later.push_back(room_id);
    } else if (room.members.empty()) {
      // All who waited have lost patience, or the members have left meanwhile.
      room.empty_since_s = now_s_;
      empty_.emplace_back(now_s_, room_id);
    }
  }
  pending_.insert(pending_.end(), later.begin(), later.end());
}

void Simulation::release_empty() {
  while (!empty_.empty() && empty_.front().first + kRoomGrace_s <= now_s_) {
    const auto [since_s, room_id] = empty_.front();
    empty_.pop_front();
    Room& room = rooms_[room_id];
    // Somebody has come meanwhile, or the room has lost its owner.
    if (room.empty_since_s != since_s || room.state != Room::State::owned || !room.members.empty()) continue;
    if (!room.waiting.empty()) continue;
    disown(room_id);
    room.state = Room::State::unowned;
    write(EtcdWrite::release);
  }
}

bool Simulation::is_full(const Server& server) const {
  return server.people >= settings_.characters_max || server.cpu_s >= settings_.overload_max * settings_.capacity();
}

}  // namespace hairnet::fleet_plan
