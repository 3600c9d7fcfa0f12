#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "server/fleet/directory.hpp"

namespace hairnet::server {

// Where a room is, or would be. Finding it changes nothing.
struct RoomPlace {
  enum class Kind : std::uint8_t {
    here,      // this server holds it
    held,      // another server does
    placed,    // nobody does, and placement gives it to this or another server
    draining,  // its holder takes no clients and is about to give it up; placement gives it to a server after that
    deciding,  // a claim or a look-up is under way: ask again
    full,      // nobody holds it, and no server takes another room
    unknown,   // the directory cannot tell
  };
  Kind kind = Kind::unknown;
  // Names the server; zero: none.
  std::uint64_t server_id = 0;
  // Is that server's.
  ServerAddress address = {};
  // Says in one line why no server is named.
  std::string reason = {};
};
// As in answers to programs: `here` is "held", too.
std::string_view to_string(RoomPlace::Kind kind);

inline constexpr const char* kNobodyTakesRooms = "no server of the fleet takes another room; try again later";

RoomPlace find_room(const Directory& fleet, std::string_view room, std::int64_t now_ns);

}  // namespace hairnet::server
