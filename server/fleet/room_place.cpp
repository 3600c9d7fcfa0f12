#include "server/fleet/room_place.hpp"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "server/fleet/choose_server.hpp"

namespace hairnet::server {
namespace {

using Kind = RoomPlace::Kind;

// The place at this server, if its address is known.
RoomPlace at_server(Kind kind, const std::vector<ServerStatus>& servers, std::uint64_t id) {
  const auto found = std::ranges::find(servers, id, &ServerStatus::id);
  // A client cannot be sent to a server without an address.
  if (found == servers.end() || found->address.port == 0)
    return {.kind = Kind::unknown, .reason = "the address of the room's server is not known"};
  return {.kind = kind, .server_id = id, .address = found->address};
}

// The place at the server that placement chooses for the room.
RoomPlace at_chosen(Kind kind, const Directory& fleet, std::string_view room) {
  const std::vector<ServerStatus> servers = fleet.servers();
  const std::optional<std::uint64_t> chosen = choose_server(room, servers, fleet.is_big(room));
  if (chosen) return at_server(kind, servers, *chosen);
  return {.kind = kind == Kind::placed ? Kind::full : kind, .reason = kNobodyTakesRooms};
}

// Returns where a room is that another server owns. An owner that drains has closed its port and is about to give the
// room up. An owner with this server's own address is this server before its restart, whose lease is about to end.
RoomPlace at_owner(const Directory& fleet, std::string_view room, Placement placement) {
  const std::vector<ServerStatus> servers = fleet.servers();
  const auto owner = std::ranges::find(servers, placement.server_id, &ServerStatus::id);
  const auto own = std::ranges::find(servers, fleet.server_id(), &ServerStatus::id);
  const bool is_former_self = own != servers.end() && own->address.host == placement.address.host &&
                              own->address.port == placement.address.port;
  if (is_former_self || (owner != servers.end() && owner->draining)) return at_chosen(Kind::draining, fleet, room);
  if (placement.address.port == 0) return at_server(Kind::held, servers, placement.server_id);
  return {.kind = Kind::held, .server_id = placement.server_id, .address = std::move(placement.address)};
}

}  // namespace

std::string_view to_string(RoomPlace::Kind kind) {
  switch (kind) {
    case Kind::here:
    case Kind::held:
      return "held";
    case Kind::placed:
      return "placed";
    case Kind::draining:
      return "draining";
    case Kind::deciding:
      return "deciding";
    case Kind::full:
      return "full";
    case Kind::unknown:
      break;
  }
  return "unknown";
}

RoomPlace find_room(const Directory& fleet, std::string_view room, std::int64_t now_ns) {
  Placement placement = fleet.where(room, now_ns);
  switch (placement.kind) {
    case Placement::Kind::here:
      return {.kind = Kind::here, .server_id = placement.server_id, .address = std::move(placement.address)};
    case Placement::Kind::elsewhere:
      return at_owner(fleet, room, std::move(placement));
    case Placement::Kind::unowned:
      return at_chosen(Kind::placed, fleet, room);
    case Placement::Kind::pending:
      return {.kind = Kind::deciding, .reason = "the fleet has not decided yet who has the room; ask again"};
    case Placement::Kind::unavailable:
      break;
  }
  return {.kind = Kind::unknown, .reason = std::move(placement.reason)};
}

}  // namespace hairnet::server
