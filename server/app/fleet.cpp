#include "server/app/fleet.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <random>
#include <utility>

#include "server/fleet/fleet_values.hpp"
#include "server/fleet/local_directory.hpp"
#include "server/transport/etcd_client.hpp"

namespace hairnet::server {
namespace {

// An ID is random at each start: a server that comes back must not pass for the one that died. Zero means none.
std::uint64_t random_id() {
  std::random_device device;
  std::uint64_t id = 0;
  while (id == 0) id = static_cast<std::uint64_t>(device()) << 32 | device();
  return id;
}

// Gauges of a tick are set only after the first one has run.
double value_or_zero(const Gauge& gauge) {
  return gauge.is_set() ? gauge.value() : 0;
}

}  // namespace

Fleet::Fleet(const Config& config, Metrics& metrics)
    : metrics_(&metrics),
      character_count_max_(config.sessions.character_count_max),
      room_count_max_(config.sessions.room_count_max),
      page_(config.fleet.page),
      largest_(config.fleet.own_server_share),
      balances_(config.fleet.balance) {}

Fleet::~Fleet() = default;

Result<std::unique_ptr<Fleet>> Fleet::create(const Config& config, std::uint16_t port, IoLoop& loop, Metrics& metrics) {
  const FleetConfig& settings = config.fleet;
  if (settings.etcd.endpoints.empty()) {
    std::unique_ptr<Fleet> fleet(new Fleet(config, metrics));
    fleet->directory_ = std::make_unique<LocalDirectory>(random_id(), fleet_address(settings, port));
    return fleet;
  }
  Result<std::unique_ptr<EtcdClient>> client = EtcdClient::create(loop, settings.etcd);
  if (!client) return Refusal(client.error());
  std::unique_ptr<Fleet> fleet = create(config, port, random_id(), **client, metrics);
  // The directory needs its transport first, and the transport its sink.
  (*client)->set_sink(fleet->sink());
  fleet->client_ = std::move(*client);
  return fleet;
}

std::unique_ptr<Fleet> Fleet::create(const Config& config, std::uint16_t port, std::uint64_t id,
                                     EtcdTransport& transport, Metrics& metrics) {
  std::unique_ptr<Fleet> fleet(new Fleet(config, metrics));
  const FleetConfig& settings = config.fleet;
  auto directory = std::make_unique<EtcdDirectory>(EtcdDirectoryDef{.server_id = id,
                                                                    .address = fleet_address(settings, port),
                                                                    .fleet = settings.name,
                                                                    .endpoint_count = settings.etcd.endpoints.size(),
                                                                    .lease_s = settings.lease_s,
                                                                    .without_etcd = settings.without_etcd,
                                                                    .rooms_max = config.sessions.room_count_max,
                                                                    .seed = id},
                                                   transport, metrics.fleet);
  fleet->in_etcd_ = directory.get();
  directory->set_big_rooms({settings.big_rooms.begin(), settings.big_rooms.end()});
  fleet->directory_ = std::move(directory);
  return fleet;
}

EtcdSink* Fleet::sink() const {
  return in_etcd_;
}

void Fleet::set_address(const ServerAddress& address) {
  if (in_etcd_) in_etcd_->set_address({.host = address.host, .port = address.port, .page = page_});
  if (on_address) on_address(address);
}

std::size_t Fleet::room_count() const {
  // In a fleet a claimed room counts before its first session, since Agones must not end the server meanwhile.
  const Gauge& rooms = is_shared() ? metrics_->fleet.gauges.rooms_owned : metrics_->tick.gauges.rooms;
  return static_cast<std::size_t>(value_or_zero(rooms));
}

void Fleet::poll(bool takes_clients, RoomLoad largest, std::int64_t now_ns) {
  ServerLoad load = measured_load(*metrics_, character_count_max_);
  if (is_shared()) {
    const TickGauges& tick = metrics_->tick.gauges;
    // The gauges of the tick are atomics, so the I/O thread may read them while a tick runs.
    largest.wanted_s = value_or_zero(tick.budget_wanted_seconds);
    largest.available_s = value_or_zero(tick.budget_available_seconds);
    largest.is_over = value_or_zero(tick.budget_over) > 0;
    largest_.observe(largest, now_ns);
    // Placement then gives this server no further room, by measured time or by the operator's list.
    load.has_big_room =
        largest_.needs_own_server() ||
        std::ranges::any_of(directory_->own_rooms(), [&](const auto& room) { return directory_->is_big(room); });
    metrics_->fleet.gauges.has_big_room.set(load.has_big_room ? 1 : 0);
    metrics_->fleet.gauges.room_overloaded.set(largest_.overloaded().empty() ? 0 : 1);
  }
  // A server that takes no more clients or rooms publishes that it has no place for a character, so that placement
  // gives it no room.
  if (!takes_clients || value_or_zero(metrics_->fleet.gauges.rooms_owned) >= static_cast<double>(room_count_max_))
    load.free_characters = 0;
  directory_->tell(load);
  directory_->poll(now_ns);
  // A room that has just come stays for a while: moving it on at once would show its people two breaks.
  std::erase_if(claimed_ns_, [now_ns](const auto& room) { return now_ns - room.second >= kRoomStay_ns; });
  for (const FleetEvent& event : directory_->take_events()) {
    if (event.kind == FleetEvent::Kind::room_claimed) claimed_ns_[event.room] = now_ns;
    if (on_event) on_event(event, now_ns);
  }
}

std::optional<RoomMove> Fleet::choose_move(const std::function<std::size_t(const std::string& room)>& characters,
                                           std::int64_t now_ns) {
  const TickGauges& tick = metrics_->tick.gauges;
  const double available_s = value_or_zero(tick.budget_available_seconds);
  if (!balances_ || !is_shared() || available_s <= 0) return {};
  const double used_share = value_or_zero(tick.budget_wanted_seconds) / available_s;
  // A room is handed over only while etcd answers: with nobody to record the new owner, two servers could have it.
  if (!balance_.is_due(used_share, now_ns) || !is_joined(now_ns) || !directory_->is_reachable()) return {};
  const std::vector<ServerStatus> servers = directory_->servers();
  const auto self = std::ranges::find(servers, directory_->server_id(), &ServerStatus::id);
  // The directory may not list this server yet, or again.
  if (self == servers.end() || self->draining) return {};
  const std::vector<std::string> names = directory_->own_rooms();
  std::vector<RoomToBalance> rooms;
  for (const std::string& name : names)
    rooms.push_back({.name = name,
                     .characters = characters(name),
                     .is_big = directory_->is_big(name) || largest_.needs_own_server(name),
                     .has_stayed = !claimed_ns_.contains(name)});
  // The mean is read before choose(), which subtracts the share of the room that moves.
  const double mean_share = balance_.used_share();
  const std::optional<RoomMove> move = balance_.choose(rooms, self->id, servers, now_ns);
  if (move)
    spdlog::info("event=room_handed_over room=\"{}\" to={} reason={} used_share={:.2f} share={:.2f}", move->room,
                 id_text(move->to), largest_.needs_own_server() ? "beside_big_room" : "short_of_time", mean_share,
                 move->share);
  return move;
}

RoomPlace Fleet::find_room(const std::string& room, std::int64_t now_ns) const {
  return server::find_room(*directory_, room, now_ns);
}

std::string Fleet::json() const {
  return fleet_json(directory_->server_id(), directory_->is_reachable(), directory_->servers(), directory_->rooms());
}

std::string Fleet::html() const {
  return fleet_html(directory_->server_id(), directory_->is_reachable(), directory_->servers(), directory_->rooms());
}

ServerLoad measured_load(Metrics& metrics, std::size_t character_count_max) {
  TickGauges& tick = metrics.tick.gauges;
  double characters = 0;
  for (std::size_t level = 0; level < kLevelCount; ++level)
    characters += value_or_zero(tick.characters[static_cast<LevelIndex>(level)]);
  ServerLoad load;
  load.characters = static_cast<std::uint32_t>(characters);
  load.free_characters =
      static_cast<std::uint32_t>(character_count_max - std::min<std::size_t>(load.characters, character_count_max));
  load.rooms = static_cast<std::uint32_t>(value_or_zero(tick.rooms));
  const double available_s = value_or_zero(tick.budget_available_seconds);
  if (available_s > 0)
    load.free_share = std::clamp(1 - value_or_zero(tick.budget_wanted_seconds) / available_s, kAnnouncedShareMin, 1.0);
  // More characters would no longer mean coarser hair, but late ticks.
  if (value_or_zero(tick.budget_over) > 0) load.free_share = 0;
  return load;
}

}  // namespace hairnet::server
