#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "server/fleet/directory.hpp"

namespace hairnet::server {

// Where a room is, or would be. Finding it changes nothing.
struct RoomPlace {
  enum class Kind : std::uint8_t {
    // This server owns the room.
    here,
    // Another server owns the room.
    held,
    // No server owns the room, and placement gives it to this or another server.
    placed,
    // The owner takes no clients and is about to give the room up; placement then gives the room to another server.
    draining,
    // A claim or a look-up is under way: ask again.
    deciding,
    // No server owns the room, and no server takes another room.
    full,
    // The directory cannot tell.
    unknown,
  };
  Kind kind = Kind::unknown;
  // The server's id; zero: none is named.
  std::uint64_t server_id = 0;
  // The address of that server.
  ServerAddress address = {};
  // One line that says why no server is named.
  std::string reason = {};
};
// The state as in the answers of /room. For `here` it is "held", as for `held`.
std::string_view to_string(RoomPlace::Kind kind);

inline constexpr const char* kNobodyTakesRooms = "no server of the fleet takes another room; try again later";

// Returns where the room is by the directory, and where nobody owns it, by placement. It does not claim the room:
// route_to_room() does.
RoomPlace find_room(const Directory& fleet, std::string_view room, std::int64_t now_ns);

}  // namespace hairnet::server
