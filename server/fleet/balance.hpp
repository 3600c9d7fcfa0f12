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

// A room of this server, as input to Balance::choose(). All characters are assumed to cost the same time.
struct RoomToBalance {
  std::string_view name;
  std::size_t characters = 0;
  // The room should have a server of its own (README.md, "Big rooms").
  bool is_big = false;
  // This server has had the room for at least kRoomStay_ns. Other rooms are not moved.
  bool has_stayed = true;
};

struct RoomMove {
  std::string room;
  // The id of the server that gets the room.
  std::uint64_t to = 0;
  // The room wants this share of this server's time.
  double share = 0;
};

// Decides which room a server that is short of time gives up, when, and to which server; README.md, "Balancing", has
// the rules. Each server decides for itself, from the loads that the other servers publish: no server plans for the
// fleet. The class reads no clock and sends nothing: the same calls give the same moves.
class Balance {
 public:
  // Call it at each poll: the calls also update the mean. Returns true at most once a second, while the server has been
  // short of time for 10 s and has moved no room for as long. `used_share` is the share of the server's time that its
  // characters want; above 1, hair is coarser than asked for. A few late ticks change this share much, so its mean over
  // about 5 s counts.
  [[nodiscard]] bool is_due(double used_share, std::int64_t now_ns);
  // Returns the move to make now, or none where no move helps. `self` is this server's id, `servers` the fleet as this
  // server knows it, in any order. The receiver keeps some free time even if every server that is short of time sends
  // it a room of this size, and if its published load does not contain this server's earlier moves yet. The largest big
  // room stays; another big room goes only to a server without rooms. The smallest room that frees enough time is
  // moved, or else the largest.
  std::optional<RoomMove> choose(std::span<const RoomToBalance> rooms, std::uint64_t self,
                                 std::span<const ServerStatus> servers, std::int64_t now_ns);
  // The mean of the `used_share` values given to is_due(), over about 5 s. After choose() it is already without the
  // share of the room that moves.
  [[nodiscard]] double used_share() const { return used_share_; }

 private:
  // An earlier move of this server. The receiver's published load may not contain the room before until_ns, so choose()
  // adds its share and characters to the receiver's load.
  struct Sent {
    std::uint64_t to = 0;
    double share = 0;
    std::size_t characters = 0;
    std::int64_t until_ns = 0;
  };

  // See used_share().
  double used_share_ = 0;
  // The time of the last is_due(); 0: there was none.
  std::int64_t observed_ns_ = 0;
  // is_due() returns true from this time on; 0: the server is not short of time.
  std::int64_t due_ns_ = 0;
  // The moves of the last kArrival_ns (balance.cpp).
  std::vector<Sent> sent_;
};

}  // namespace hairnet::server
