#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace hairnet::server {

// Where clients reach a server.
struct ServerAddress {
  // A name or a numeric address.
  std::string host;
  // The public port; zero: the address is not known.
  std::uint16_t port = 0;
  // The URL of its page; empty: it has none.
  std::string page;
  bool operator==(const ServerAddress&) const = default;
};

// The smallest free share that a server announces while coarser levels still make room for more characters.
inline constexpr double kAnnouncedShareMin = 1.0 / 16;

// What a server has to do, and how much more it could do.
struct ServerLoad {
  // The share of the tick's time that its characters do not want, 0 to 1. It is at least kAnnouncedShareMin while the
  // coarsest levels of all characters fit, and else 0 (measured_load in app/fleet.hpp).
  double free_share = 1;
  std::uint32_t free_characters = 0;
  std::uint32_t characters = 0;
  std::uint32_t rooms = 0;
  // One of its rooms needs the server alone.
  bool has_big_room = false;
  bool operator==(const ServerLoad&) const = default;
};

// Names a groom's file by its hash.
using ContentHash = std::array<std::uint8_t, 32>;
// Bounds the grooms that a draining server names: 64 hashes are 2 KiB of its entry, before base64.
inline constexpr std::size_t kPassedGroomsMax = 64;

// One server of the fleet, as it tells the others.
struct ServerStatus {
  // Random at its start; zero is no server.
  std::uint64_t id = 0;
  ServerAddress address = {};
  ServerLoad load = {};
  // The server takes no more rooms, and is about to end.
  bool draining = false;
  // While the server drains: the grooms that the next owners of its rooms will need.
  std::vector<ContentHash> grooms = {};
  bool operator==(const ServerStatus&) const = default;
};

// Who owns a room. A claim's number is greater than those of all earlier claims of any room of the fleet.
struct RoomOwner {
  std::string room;
  std::uint64_t server_id = 0;
  std::int64_t claim = 0;
  bool operator==(const RoomOwner&) const = default;
};

}  // namespace hairnet::server
