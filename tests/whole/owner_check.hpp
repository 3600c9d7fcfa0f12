#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace hairnet::whole {

// The promise of a fleet, checked by what clients receive: no two servers send frames of one room at one true time. All
// times are CLOCK_MONOTONIC of one machine, which all its processes share.
//
// A packet's time is the one that the server stamps: the moment at which it asked the fence. The number of the claim
// under which the packet was sent is that of the server's newest `room_claimed` of the room before this moment. Then
//  - every packet with an older claim's frames is stamped before the first one with a newer claim's, for all clients
//    together, with no tolerance;
//  - no client receives an older claim's frames after a newer one's;
//  - nobody sends frames of a room without a claim.
// A packet of the older owner that was stamped before the newer owner's first packet may arrive after it. Such packets
// are no fault; they are counted as in flight.
class OwnerCheck {
 public:
  // `server` is one process, a number that is never used again.
  void claimed(std::size_t server, const std::string& room, std::int64_t claim, std::int64_t at_ns);
  // Call it only after claimed() was called for all claims before `stamp_ns`.
  void received(std::size_t client, std::size_t server, const std::string& room, std::int64_t stamp_ns,
                std::int64_t arrival_ns);

  struct Owner {
    std::size_t server = 0;
    std::int64_t claim = 0;
    std::int64_t claimed_ns = 0;
    // The first and the last stamp of this owner's frames.
    std::int64_t first_ns = 0, last_ns = 0;
  };
  // Returns the owner with the newest claim under which frames came. It is empty before any frame of the room.
  [[nodiscard]] std::optional<Owner> owner(const std::string& room) const;
  // The time of the room's first claim after `after_ns`, and of the first frame under a claim after it.
  [[nodiscard]] std::optional<std::int64_t> claimed_after(const std::string& room, std::int64_t after_ns) const;
  [[nodiscard]] std::optional<std::int64_t> frames_after(const std::string& room, std::int64_t after_ns) const;
  std::vector<std::string> take_faults() { return std::exchange(faults_, {}); }

  // The numbers of packets with frames, and of claims under which frames came.
  std::uint64_t packets = 0, owners = 0;
  // The longest time, by stamps, for which an older owner went on after a newer one had begun. 0 is as it must be.
  std::int64_t overlap_ns_max = 0;
  // The number of packets in flight.
  std::uint64_t in_flight = 0;
  // The longest time from a newer owner's first stamp to the arrival of a packet in flight.
  std::int64_t in_flight_ns_max = 0;

 private:
  // The time in which one server owns a room under one claim.
  struct Reign {
    std::size_t server = 0;
    std::int64_t claimed_ns = 0;
    // The first and the last stamp of the frames under this claim; the first is 0 before any frame.
    std::int64_t first_ns = 0, last_ns = 0;
    // Its overlap with a newer reign was reported already.
    bool is_faulty = false;
  };
  // The key is the number of the claim.
  using Reigns = std::map<std::int64_t, Reign>;
  struct Room {
    Reigns reigns;
    // The newest claim that each client has had frames of.
    std::map<std::size_t, std::int64_t> newest;
  };
  void check(const std::string& room, Reigns& reigns, Reigns::iterator changed);
  void fault(std::string what) { faults_.push_back(std::move(what)); }

  std::map<std::string, Room> rooms_;
  std::vector<std::string> faults_;
};

}  // namespace hairnet::whole
