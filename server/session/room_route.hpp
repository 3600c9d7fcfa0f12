#pragma once

#include <cstdint>
#include <string>

#include "server/fleet/directory.hpp"

namespace hairnet::server {

// Where a client belongs that asks this server for a room.
struct RoomRoute {
  enum class Kind : std::uint8_t {
    // This server holds the room.
    here,
    // The server at `address` holds it, or should take it.
    elsewhere,
    // The directory has not decided yet: ask again at the next poll.
    wait,
    // Nobody can take it for the moment; `reason` is one line.
    unavailable,
  };
  Kind kind = Kind::unavailable;
  ServerAddress address = {};
  std::string reason = {};
};

// Says where the room is, and begins to claim a room that nobody holds and placement gives to this server. With
// `redirects`, another server has sent the client here: this server then takes the room although its own view of the
// fleet may differ. If each server trusted only its own view, two servers with different views would send the client
// back and forth.
RoomRoute route_to_room(Directory& fleet, const std::string& room, unsigned redirects, std::int64_t now_ns);

}  // namespace hairnet::server
