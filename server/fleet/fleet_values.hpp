#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "server/fleet/room_place.hpp"
#include "server/fleet/server_status.hpp"

namespace hairnet::server {

// A host has at most the 255 bytes of a DNS name; the URL of a page has at most kPageBytesMax bytes.
inline constexpr std::size_t kHostBytesMax = 255, kPageBytesMax = 1024;

// The text of an id in keys and pages: exactly 16 hexadecimal digits. parse_id() returns none for any other text, and
// for 0.
std::string id_text(std::uint64_t id);
std::optional<std::uint64_t> parse_id(std::string_view text);

// Returns an empty string when clients can use the address; else one line.
std::string validate(const ServerAddress& address);

// The value of a server's key: JSON. parse_status checks everything, since any server of the fleet may have written it.
std::string to_value(const ServerStatus& status);
Result<ServerStatus> parse_status(std::string_view value);

// The value of a room's key: the id of its owner.
std::string owner_value(std::uint64_t server_id);
std::optional<std::uint64_t> parse_owner(std::string_view value);

// The rules and state of a room that move with it to its next owner, as the text of Directory::keep().
struct RoomKept {
  struct Ban {
    std::string subject;
    // The ban ends at this time, in seconds since 1970.
    std::int64_t until_s = 0;
    bool operator==(const Ban&) const = default;
  };
  std::vector<Ban> bans = {};
  std::vector<std::string> mutes = {};
  bool is_locked = false;
  // The members of a locked room may come back to it.
  std::vector<std::string> members = {};
  // A packet with the wind; empty: the server's setting.
  std::vector<std::uint8_t> wind = {};
  // A packet with the props; empty: there are none.
  std::vector<std::uint8_t> props = {};
  bool operator==(const RoomKept&) const = default;
};
// Below etcd::kValueBytesMax, so that a text that this server writes is never skipped as too long by its next owner.
inline constexpr std::size_t kKeptBytesMax = std::size_t{60} << 10;

// Returns JSON of at most kKeptBytesMax, or an empty text where there is nothing to keep. Mutes are taken first, then
// bans in their order, then members, then the props, all or none of them; `left_out` counts what did not fit.
std::string to_value(const RoomKept& kept, std::size_t& left_out);
Result<RoomKept> parse_kept(std::string_view value);

// The body of the answer to /room: the room, its state, and the server with its address, or the reason why no server is
// named.
std::string room_json(std::string_view room, const RoomPlace& place);

// The pages that show the fleet: servers, and rooms with their owners. `self` is the server that answers. The one for
// people has the first 500 of each, and loads itself again every second.
std::string fleet_html(std::uint64_t self, bool is_reachable, std::span<const ServerStatus> servers,
                       std::span<const RoomOwner> rooms);
std::string fleet_json(std::uint64_t self, bool is_reachable, std::span<const ServerStatus> servers,
                       std::span<const RoomOwner> rooms);

}  // namespace hairnet::server
