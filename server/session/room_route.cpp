#include "server/session/room_route.hpp"

#include <utility>

#include "server/fleet/room_place.hpp"

namespace hairnet::server {

RoomRoute route_to_room(Directory& fleet, const std::string& room, unsigned redirects, std::int64_t now_ns) {
  RoomPlace place = find_room(fleet, room, now_ns);
  const bool is_unowned = place.kind == RoomPlace::Kind::placed || place.kind == RoomPlace::Kind::full;
  const bool is_mine = place.server_id == fleet.server_id() || redirects > 0;
  // With redirects, another server has chosen this one, so this server claims the room even if its own view of the
  // fleet says that no server takes another room (Kind::full).
  if (is_unowned && is_mine && fleet.claim(room, now_ns)) {
    // The poll sends the claim at once: the client waits for it.
    fleet.poll(now_ns);
    return {RoomRoute::Kind::wait, {}, {}};
  }
  switch (place.kind) {
    case RoomPlace::Kind::here:
      return {RoomRoute::Kind::here, {}, {}};
    case RoomPlace::Kind::placed:
      // Placement chose this server, but claim() has refused: a Redirect to itself would send the client in a circle.
      if (place.server_id == fleet.server_id()) return {RoomRoute::Kind::unavailable, {}, kNobodyTakesRooms};
      [[fallthrough]];
    case RoomPlace::Kind::held:
      return {RoomRoute::Kind::elsewhere, std::move(place.address), {}};
    case RoomPlace::Kind::draining:
    case RoomPlace::Kind::deciding:
      // The copy of the directory may be old, and a client waits: a watch that stays silent is soon replaced.
      fleet.look_again(now_ns);
      return {RoomRoute::Kind::wait, {}, {}};
    case RoomPlace::Kind::full:
    case RoomPlace::Kind::unknown:
      break;
  }
  return {RoomRoute::Kind::unavailable, {}, std::move(place.reason)};
}

}  // namespace hairnet::server
