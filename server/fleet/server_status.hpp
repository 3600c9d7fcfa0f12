#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace hairnet::server {

// Where clients reach a server.
struct ServerAddress {
  std::string host;        // a name or a numeric address
  std::uint16_t port = 0;  // of its public port; 0: the address is not known
  std::string page;        // URL of its page; empty: none
  bool operator==(const ServerAddress&) const = default;
};

// The least free share that a server tells while coarser levels still make room for more characters.
inline constexpr double kFreeShareLeast = 1.0 / 16;

// What a server has to do, and how much more it could do.
struct ServerLoad {
  double free_share = 1;  // of its tick's time, 0 to 1
  std::uint32_t free_characters = 0;
  std::uint32_t characters = 0;
  std::uint32_t rooms = 0;
  bool has_big_room = false;  // that needs the server alone
  bool operator==(const ServerLoad&) const = default;
};

using ContentHash = std::array<std::uint8_t, 32>;  // of a groom's file
inline constexpr std::size_t kPassedGroomsMax = 64;

// One server of the fleet, as it tells the others.
struct ServerStatus {
  std::uint64_t id = 0;  // random at its start; 0 is none
  ServerAddress address = {};
  ServerLoad load = {};
  bool draining = false;                 // takes no more rooms, and is about to end
  std::vector<ContentHash> grooms = {};  // while it drains: that its rooms need at their next servers
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
