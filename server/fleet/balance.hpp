#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/fleet/server_status.hpp"

namespace hairnet::server {

// A room stays on a server for this long before it is moved on: its people must not be sent from server to server.
inline constexpr std::int64_t kRoomStay_ns = 30'000'000'000;

// A room of this server. Characters are taken to cost alike.
struct RoomToBalance {
  std::string_view name;
  std::size_t characters = 0;
  // It should have a server of its own.
  bool is_big = false;
  // It has been here for kRoomStay_ns.
  bool has_stayed = true;
};

struct RoomMove {
  std::string room;
  // The id of the server that gets the room.
  std::uint64_t to = 0;
  // The room wants this share of this server's time.
  double share = 0;
};

// Which room a server that is short of time gives up, when, and to which server. Each server decides for itself, from
// the loads that the others publish: no server plans for the fleet. It has no clock, and asks nobody: the same calls
// give the same moves.
class Balance {
 public:
  // Ask all the time. True at most once a second, while the server has been short of time for 10 s and has moved no
  // room for as long. `used_share`: of the server's time, that its characters want; above 1, hair is coarser than asked
  // for. A few late ticks change it much, so its mean over some seconds counts.
  [[nodiscard]] bool is_due(double used_share, std::int64_t now_ns);
  // None where no move helps. `servers`: the fleet as this server knows it, in any order. The receiver keeps some free
  // time even if every server that is short of time sends it a room like this one, and if no load of this server's
  // earlier moves shows yet. The largest big room stays; another big room goes only to a server without rooms. The
  // smallest room that frees enough time is moved, or else the largest.
  std::optional<RoomMove> choose(std::span<const RoomToBalance> rooms, std::uint64_t self,
                                 std::span<const ServerStatus> servers, std::int64_t now_ns);
  // The mean share of its time that the server's characters want; above 1, hair is coarser than asked for.
  [[nodiscard]] double used_share() const { return used_share_; }

 private:
  // A room that was moved, and may not show in the load of its receiver yet.
  struct Sent {
    std::uint64_t to = 0;
    double share = 0;
    std::size_t characters = 0;
    std::int64_t until_ns = 0;
  };

  double used_share_ = 0;
  std::int64_t observed_ns_ = 0;
  // A move is due at this time; 0: the server is not short of time.
  std::int64_t due_ns_ = 0;
  std::vector<Sent> sent_;
};

}  // namespace hairnet::server
