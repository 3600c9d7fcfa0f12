#pragma once

#include <cstdint>
#include <string>

#include "server/fleet/directory.hpp"

namespace hairnet::server {

// Where a client belongs that asks this server for a room.
struct RoomRoute {
  enum class Kind : std::uint8_t {
    // This server owns the room.
    here,
    // The server at `address` owns the room, or should claim it.
    elsewhere,
    // The directory has not decided yet: ask again at the next poll.
    wait,
    // No server can take the room now; `reason` is one line.
    unavailable,
  };
  Kind kind = Kind::unavailable;
  ServerAddress address = {};
  std::string reason = {};
};

// Returns where the room is. If nobody owns the room and it belongs on this server, the call begins to claim it.
// `redirects` is how often other servers have sent the client on (Hello.redirects). Above 0, a room that nobody owns
// belongs on this server, whatever its own view of the fleet says: otherwise two servers with different views would
// send the client back and forth.
RoomRoute route_to_room(Directory& fleet, const std::string& room, unsigned redirects, std::int64_t now_ns);

}  // namespace hairnet::server
