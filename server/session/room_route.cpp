#include "server/session/room_route.hpp"

#include <utility>

#include "server/fleet/room_place.hpp"

namespace hairnet::server {

RoomRoute route_to_room(Directory& fleet, const std::string& room, unsigned redirects, std::int64_t now_ns) {
  RoomPlace place = find_room(fleet, room, now_ns);
  const bool is_unowned = place.kind == RoomPlace::Kind::placed || place.kind == RoomPlace::Kind::full;
  const bool is_mine = place.server_id == fleet.server_id() || redirects > 0;
  if (is_unowned && is_mine && fleet.claim(room, now_ns)) {
    fleet.poll(now_ns);  // sends the claim
    return {RoomRoute::Kind::wait, {}, {}};
  }
  switch (place.kind) {
    case RoomPlace::Kind::here:
      return {RoomRoute::Kind::here, {}, {}};
    case RoomPlace::Kind::placed:
      if (place.server_id == fleet.server_id()) return {RoomRoute::Kind::unavailable, {}, kNobodyTakesRooms};
      [[fallthrough]];
    case RoomPlace::Kind::held:
      return {RoomRoute::Kind::elsewhere, std::move(place.address), {}};
    case RoomPlace::Kind::draining:
    case RoomPlace::Kind::deciding:
      fleet.look_again(now_ns);
      return {RoomRoute::Kind::wait, {}, {}};
    case RoomPlace::Kind::full:
    case RoomPlace::Kind::unknown:
      break;
  }
  return {RoomRoute::Kind::unavailable, {}, std::move(place.reason)};
}

}  // namespace hairnet::server
