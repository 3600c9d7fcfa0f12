#include "server/fleet/etcd_directory.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

namespace hairnet::server {

EtcdDirectory::EtcdDirectory(const EtcdDirectoryDef& def, EtcdTransport& transport, FleetCounters& counters)
    : def_(def),
      counters_(&counters),
      calls_(def_, transport, counters),
      lease_(def_, calls_, fence_, counters,
             {.on_granted = [this] { entry_.on_lease_granted(); },
              .on_lost = [this] { on_lease_lost(); },
              .on_fence = [this](bool is_open) { on_fence(is_open); }}),
      entry_(def_, calls_, lease_),
      copy_(def_, calls_, counters,
            {.on_listed = [this] { on_listed(); },
             .on_room = [this](const std::string& room, std::int64_t revision) { rooms_.check(room, revision); },
             .on_server = [this](const etcd::KeyValue& entry) { on_server(entry); },
             .on_news =
                 [this] {
                   if (on_news) on_news();
                 }}),
      rooms_(def_, calls_, lease_, entry_, copy_, counters, [this](FleetEvent event) { emit(std::move(event)); }) {}

Placement EtcdDirectory::where(std::string_view room, std::int64_t now_ns) const {
  using Kind = Placement::Kind;
  if (lease_.is_ending()) return {.kind = Kind::unavailable, .reason = "the server ends"};
  if (!has_address()) return {.kind = Kind::unavailable, .reason = "the server does not know its public address yet"};
  return rooms_.where(room, now_ns);
}

void EtcdDirectory::stop(std::int64_t) {
  if (lease_.is_ending()) return;
  lease_.stop();
  rooms_.clear();
  // All calls end here; the next poll revokes the lease, which deletes all keys of this server at once.
  calls_.stop_all();
}

void EtcdDirectory::poll(std::int64_t now_ns) {
  // Other servers could send no client here while the address is not known, so the server does not join the fleet yet.
  if (!has_address()) return;
  // Overdue calls end first: the polls below may send what these calls were about again.
  calls_.end_overdue(now_ns);
  lease_.poll(now_ns);
  if (!lease_.is_ending()) {
    if (calls_.may_start(now_ns)) {
      // The server's entry is written only when the copy is complete. Placement would otherwise send rooms to a server
      // that does not know yet which rooms have owners.
      if (copy_.is_listed()) entry_.poll(now_ns);
      copy_.poll(now_ns);
    }
    rooms_.poll(now_ns);
  }
  set_gauges(now_ns);
}

std::vector<FleetEvent> EtcdDirectory::take_events() {
  for (const FleetEvent& event : events_)
    // The caller has the room's text from now on, so clients may enter.
    if (event.kind == FleetEvent::Kind::room_claimed) rooms_.on_announced(event.room);
  return std::exchange(events_, {});
}

std::vector<ServerStatus> EtcdDirectory::servers() const {
  const ServerStatus& self = entry_.status();
  std::vector<ServerStatus> all;
  for (const auto& [id, status] : copy_.view().servers())
    if (id != self.id) all.push_back(status);
  all.insert(std::ranges::lower_bound(all, self.id, {}, &ServerStatus::id), self);
  return all;
}

std::vector<RoomOwner> EtcdDirectory::rooms() const {
  std::vector<RoomOwner> all;
  for (const auto& [name, owner] : copy_.view().rooms())
    all.push_back({.room = name, .server_id = owner.server_id, .claim = owner.claim});
  return all;
}

void EtcdDirectory::on_lease_lost() {
  spdlog::warn("event=lease_lost rooms={}", rooms_.count());
  rooms_.on_lease_lost();
}

void EtcdDirectory::on_fence(bool is_open) {
  spdlog::warn("event={} rooms={}", is_open ? "lease_resumed" : "lease_paused", rooms_.count());
  emit({.kind = is_open ? FleetEvent::Kind::lease_resumed : FleetEvent::Kind::lease_paused});
}

void EtcdDirectory::on_listed() {
  // etcd has no entry of this server: it was not written yet, or another program has deleted it.
  if (!copy_.view().server(def_.server_id)) entry_.write_again();
  rooms_.check_all();
}

void EtcdDirectory::on_server(const etcd::KeyValue& entry) {
  entry_.check(entry);
  const ServerStatus* server = copy_.view().server_of(entry.key);
  if (server && server->id != def_.server_id && !server->grooms.empty())
    emit({.kind = FleetEvent::Kind::grooms_passed_on, .grooms = server->grooms});
}

void EtcdDirectory::emit(FleetEvent event) {
  events_.push_back(std::move(event));
  if (on_news) on_news();
}

void EtcdDirectory::set_gauges(std::int64_t now_ns) {
  FleetGauges& gauges = counters_->gauges;
  gauges.etcd_up.set(is_reachable() ? 1 : 0);
  gauges.lease_valid.set(fence_.is_open(now_ns) ? 1 : 0);
  gauges.servers.set(static_cast<double>(copy_.view().servers().size()));
  gauges.rooms.set(static_cast<double>(copy_.view().rooms().size()));
  gauges.rooms_owned.set(static_cast<double>(rooms_.count()));
}

}  // namespace hairnet::server
