#pragma once

#include <cstdint>
#include <string>

#include "server/fleet/directory.hpp"

namespace hairnet::server {

// Where a client belongs that asks this server for a room.
struct RoomRoute {
  enum class Kind : std::uint8_t {
    here,         // this server holds the room
    elsewhere,    // the server at `address` holds it, or should take it
    wait,         // the directory has not decided yet; ask again at the next poll
    unavailable,  // nobody can take it for the moment; `reason` is one line
  };
  Kind kind = Kind::unavailable;
  ServerAddress address = {};
  std::string reason = {};
};

// Begins to claim a room that nobody holds and placement gives to this server. Another server has a client with
// redirects sent here: this server then takes the room although its own view of the fleet may differ.
RoomRoute route_to_room(Directory& fleet, const std::string& room, unsigned redirects, std::int64_t now_ns);

}  // namespace hairnet::server
