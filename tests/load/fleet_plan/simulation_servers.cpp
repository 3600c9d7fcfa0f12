#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/assert.hpp"
#include "tests/load/fleet_plan/simulation.hpp"

namespace hairnet::fleet_plan {
namespace {

// Servers announce their free share rounded to 1/32, as in server/fleet/etcd_entry.cpp, so that small changes are no
// writes to etcd.
constexpr double kAnnouncedShareSteps = 32;
// A room that takes more than this share of a server should be alone there: the default of
// FleetConfig::own_server_share.
constexpr double kOwnServerShare = 0.5;
// Autoscaling stops at most this share of the servers at a time, so that few rooms move at once.
constexpr double kScaleInShare = 0.05;

}  // namespace

ServerSlot Simulation::start_server(std::int64_t ready_at_s) {
  const auto slot = static_cast<ServerSlot>(servers_.size());
  HAIRNET_ASSERT(slot < 1u << kSlotBits);
  Server& server = servers_.emplace_back();
  // The bit above the slot is always set, so the id is never 0, which would be no server.
  // The lower kSlotBits bits of an id are the slot, so an id leads to its server. The other bits are random, as real
  // ids are: placement is by their hash.
  server.id = (random_.next() | 1u << kSlotBits) >> kSlotBits << kSlotBits | slot;
  server.ready_at_s = ready_at_s;
  server.hairstyle_at_s.assign(settings_.hairstyles, std::numeric_limits<double>::infinity());
  active_.push_back(slot);
  ++outcome_.servers_started;
  return slot;
}

// The server gets its lease, and puts its entry into etcd. The first keep-alive comes at a random time within a third
// of the lease, so that the keep-alives of servers that start together are spread out.
void Simulation::make_ready(ServerSlot slot) {
  Server& server = servers_[slot];
  server.state = Server::State::ready;
  const auto now_s = static_cast<double>(now_s_);
  server.fails_at_s = settings_.mtbf_h > 0 ? now_s + exponential(random_) * settings_.mtbf_h * 3600
                                           : std::numeric_limits<double>::infinity();
  server.keep_alive_at_s = now_s + random_.unit() * settings_.lease_s / 3;
  ++second_.writes[static_cast<std::size_t>(EtcdWrite::lease)];
  statuses_.push_back({.id = server.id, .address = {}, .load = load_of(server)});
  status_slots_.push_back(slot);
  write(EtcdWrite::status);
}

void Simulation::take_starts_and_ends() {
  for (const ServerSlot slot : std::vector<ServerSlot>(active_)) {
    Server& server = servers_[slot];
    if (server.state == Server::State::starting && now_s_ >= server.ready_at_s) make_ready(slot);
    if (server.state == Server::State::ready && static_cast<double>(now_s_) >= server.fails_at_s) kill(slot);
    if (server.state == Server::State::dead && now_s_ >= server.lease_ends_s) end(slot);
  }
}

// Keep-alives come at every third of the lease, so the last one was up to that long ago, and the lease ends after two
// thirds of its time or more. The rooms wait until then.
void Simulation::kill(ServerSlot slot) {
  Server& server = servers_[slot];
  HAIRNET_ASSERT(server.state == Server::State::ready);
  ++outcome_.failures;
  const double lease_s = settings_.lease_s, last_s = server.keep_alive_at_s - lease_s / 3;
  server.lease_ends_s = std::max(now_s_ + 1, static_cast<std::int64_t>(std::ceil(last_s + lease_s)));
  for (const RoomId room : server.rooms) stop_serving(room, MoveCause::failure, server.lease_ends_s);
  server.state = Server::State::dead;
}

// The server marks its entry as draining, so that no room is placed there, and gives its rooms up at once.
void Simulation::drain(ServerSlot slot, MoveCause cause) {
  Server& server = servers_[slot];
  HAIRNET_ASSERT(server.state == Server::State::ready);
  statuses_[static_cast<std::size_t>(std::ranges::find(status_slots_, slot) - status_slots_.begin())].draining = true;
  write(EtcdWrite::status);
  write(EtcdWrite::release, server.rooms.size());
  for (const RoomId room : server.rooms) stop_serving(room, cause, now_s_);
  ++second_.writes[static_cast<std::size_t>(EtcdWrite::lease)];
  end(slot);
  ++outcome_.servers_stopped;
}

// Removes all keys of the server from etcd. When the lease of a dead server ends, the watches of the others hear of
// each of its rooms; a drained server has released its rooms before.
void Simulation::end(ServerSlot slot) {
  Server& server = servers_[slot];
  const auto at = std::ranges::find(status_slots_, slot) - status_slots_.begin();
  const std::size_t watchers = count(Server::State::ready);
  const bool is_expiry = server.state == Server::State::dead;
  second_.watch_events += (1 + (is_expiry ? server.rooms.size() : 0)) * watchers;
  while (!server.rooms.empty()) disown(server.rooms.back());
  statuses_.erase(statuses_.begin() + at);
  status_slots_.erase(status_slots_.begin() + at);
  server.state = Server::State::ended;
  std::erase(active_, slot);
  server.hairstyle_at_s = {};
}

std::size_t Simulation::count(Server::State state) const {
  return static_cast<std::size_t>(
      std::ranges::count_if(active_, [&](ServerSlot slot) { return servers_[slot].state == state; }));
}

// Returns how many servers there should be: as many as all rooms need, those without a server included, and a buffer.
std::size_t Simulation::target() const {
  if (settings_.servers != 0) return settings_.servers;
  double cpu_s = cpu_s_;
  for (const RoomId room : pending_)
    if (rooms_[room].state == Room::State::away) cpu_s += rooms_[room].cpu_s;
  const double with_buffer = cpu_s * (1 + settings_.buffer) / settings_.capacity();
  return std::max<std::size_t>(settings_.servers_min, static_cast<std::size_t>(std::ceil(with_buffer)));
}

void Simulation::scale() {
  const std::size_t wanted = target(), ready = count(Server::State::ready),
                    there = ready + count(Server::State::starting);
  for (std::size_t i = there; i < wanted; ++i)
    start_server(now_s_ + static_cast<std::int64_t>(std::llround(settings_.start_s)));
  // A rolling update has more servers than are needed, on purpose.
  if (there <= wanted || ready <= wanted || is_deploying_) {
    too_many_since_s_ = -1;
    return;
  }
  if (too_many_since_s_ < 0) too_many_since_s_ = now_s_;
  if (static_cast<double>(now_s_ - too_many_since_s_) < settings_.scale_in_s) return;
  const auto most = std::max<std::size_t>(1, static_cast<std::size_t>(kScaleInShare * static_cast<double>(ready)));
  for (std::size_t i = 0; i < std::min(most, ready - wanted); ++i) {
    ServerSlot emptiest = kNone;
    for (const ServerSlot slot : active_) {
      if (servers_[slot].state != Server::State::ready) continue;
      if (emptiest == kNone || servers_[slot].people < servers_[emptiest].people) emptiest = slot;
    }
    drain(emptiest, MoveCause::scale_in);
  }
}

// A rolling update: new servers start, and as many old ones are drained when the new ones are ready. The first update
// begins after half of Settings::deploy_h.
void Simulation::deploy() {
  if (settings_.deploy_h <= 0) return;
  const auto period_s = static_cast<std::int64_t>(settings_.deploy_h * 3600);
  if (now_s_ % period_s == period_s / 2) {
    is_deploying_ = true;
    ++outcome_.deploys;
    for (const ServerSlot slot : active_) servers_[slot].is_old = true;
  }
  if (!is_deploying_) return;
  const auto is_old = [&](ServerSlot slot) {
    return servers_[slot].is_old && servers_[slot].state == Server::State::ready;
  };
  std::size_t ready = count(Server::State::ready);
  for (const ServerSlot slot : std::vector<ServerSlot>(active_)) {
    if (ready <= target()) break;
    if (!is_old(slot)) continue;
    drain(slot, MoveCause::deploy);
    --ready;
  }
  const auto old = static_cast<std::size_t>(std::ranges::count_if(active_, is_old));
  const std::size_t starting = count(Server::State::starting);
  is_deploying_ = old > 0 || std::ranges::any_of(active_, [&](ServerSlot slot) { return servers_[slot].is_old; });
  if (starting > 0 || old == 0) return;
  const auto batch = static_cast<std::size_t>(std::ceil(settings_.deploy_share * static_cast<double>(ready)));
  for (std::size_t i = 0; i < std::min(std::max<std::size_t>(1, batch), old); ++i)
    start_server(now_s_ + static_cast<std::int64_t>(std::llround(settings_.start_s)));
}

// Returns the load as a server announces it: measured_load in server/app/fleet.cpp, with the free share rounded as in
// EtcdEntry::tell. Servers announce a small free share while they can still lower detail, and 0 only at overload_max.
server::ServerLoad Simulation::load_of(const Server& server) const {
  server::ServerLoad load;
  const double used_share = server.cpu_s / settings_.capacity();
  load.free_share = std::round(std::clamp(1 - used_share, server::kAnnouncedShareMin, 1.0) * kAnnouncedShareSteps) /
                    kAnnouncedShareSteps;
  if (used_share >= settings_.overload_max) load.free_share = 0;
  load.characters = server.people;
  load.free_characters = settings_.characters_max - std::min(server.people, settings_.characters_max);
  load.rooms = static_cast<std::uint32_t>(server.rooms.size());
  load.has_big_room = std::ranges::any_of(server.rooms, [this](RoomId room) { return is_big(rooms_[room]); });
  return load;
}

// Servers that are short of time give up rooms by the servers' own rule (server/fleet/balance).
void Simulation::balance() {
  if (!settings_.balance) return;
  const std::int64_t now_ns = now_s_ * 1'000'000'000;
  for (std::size_t i = 0; i < statuses_.size(); ++i) {
    Server& server = servers_[status_slots_[i]];
    const double used_share = server.cpu_s / settings_.capacity();
    if (server.state != Server::State::ready || !server.balance.is_due(used_share, now_ns)) continue;
    std::vector<server::RoomToBalance> rooms;
    for (const RoomId id : server.rooms)
      rooms.push_back({.name = room_names_[id],
                       .characters = rooms_[id].members.size(),
                       .is_big = is_big(rooms_[id]),
                       .has_stayed = now_ns - rooms_[id].since_s * 1'000'000'000 >= server::kRoomStay_ns});
    const auto move = server.balance.choose(rooms, server.id, statuses_, now_ns);
    if (!move) continue;
    move_room(server.rooms[static_cast<std::size_t>(std::ranges::find(rooms, move->room, &server::RoomToBalance::name) -
                                                    rooms.begin())],
              static_cast<ServerSlot>(move->to & kSlotMask));
  }
}

bool Simulation::is_big(const Room& room) const {
  return room.cpu_s > kOwnServerShare * settings_.capacity();
}

// Counts writes that change keys. Each ready server watches all keys, so each gets an event of each write.
void Simulation::write(EtcdWrite kind, std::size_t writes) {
  second_.writes[static_cast<std::size_t>(kind)] += writes;
  second_.watch_events += writes * count(Server::State::ready);
}

void Simulation::tell_statuses() {
  for (std::size_t i = 0; i < statuses_.size(); ++i) {
    const Server& server = servers_[status_slots_[i]];
    if (server.state != Server::State::ready) continue;
    const server::ServerLoad load = load_of(server);
    if (load == statuses_[i].load) continue;
    statuses_[i].load = load;
    write(EtcdWrite::status);
  }
}

void Simulation::keep_alive() {
  for (const ServerSlot slot : active_) {
    Server& server = servers_[slot];
    if (server.state != Server::State::ready) continue;
    for (; server.keep_alive_at_s < static_cast<double>(now_s_) + 1; server.keep_alive_at_s += settings_.lease_s / 3)
      ++second_.writes[static_cast<std::size_t>(EtcdWrite::keep_alive)];
  }
}

}  // namespace hairnet::fleet_plan
