#include "server/fleet/balance.hpp"

#include <algorithm>
#include <iterator>

#include "server/fleet/choose_server.hpp"

namespace hairnet::server {
namespace {

// A move shall bring this server's used share down to this value. A server is short of time above 15/16 (1 -
// kAnnouncedShareMin). Between the two values nothing happens, so that no room is sent back.
constexpr double kUsedShareAfter = 0.85;
// The receiver keeps at least this free share. It is more than the 1/16 at which a server is short of time, so a move
// does not make the receiver give rooms away in its turn.
constexpr double kFreeShareAfter = 0.15;
// A server that is short of time looks for a move once in kLookInterval_ns. A shortage that ends within kShortOfTime_ns
// moves nothing, because a move costs each client of the room a reconnection.
constexpr std::int64_t kLookInterval_ns = 1'000'000'000, kShortOfTime_ns = 10'000'000'000;
// The time constant of the mean used share.
constexpr double kMean_ns = 5e9;
// The receiver's published load may not contain a moved room for this long: the clients must connect, levels are read
// from a cache, and costs are measured.
constexpr std::int64_t kArrival_ns = 60'000'000'000;

// Returns the number of servers, this one included, that may send a room to the same receiver before its published load
// contains any of these rooms. They are the servers that announce the smallest free share, which means that they are
// short of time. A server with a single room moves none.
std::size_t count_givers(std::uint64_t self, std::span<const ServerStatus> servers) {
  return 1 + static_cast<std::size_t>(std::ranges::count_if(servers, [self](const ServerStatus& server) {
           return server.id != self && !server.draining && server.load.rooms > 1 &&
                  server.load.free_share <= kAnnouncedShareMin;
         }));
}

// Returns the big room with the most characters; null: no room is big.
const RoomToBalance* largest_big(std::span<const RoomToBalance> rooms) {
  const RoomToBalance* largest = nullptr;
  for (const RoomToBalance& room : rooms)
    if (room.is_big && (!largest || room.characters > largest->characters)) largest = &room;
  return largest;
}

}  // namespace

bool Balance::is_due(double used_share, std::int64_t now_ns) {
  // An exponential mean over kMean_ns, for any interval between calls. At the first call the gain is 1, so that the
  // mean begins with a true value.
  const double gain = std::min(1.0, static_cast<double>(now_ns - observed_ns_) / kMean_ns);
  used_share_ += gain * (used_share - used_share_);
  observed_ns_ = now_ns;
  if (used_share_ < 1 - kAnnouncedShareMin) {
    due_ns_ = 0;
    return false;
  }
  if (due_ns_ == 0) due_ns_ = now_ns + kShortOfTime_ns;
  if (now_ns < due_ns_) return false;
  due_ns_ = now_ns + kLookInterval_ns;
  return true;
}

std::optional<RoomMove> Balance::choose(std::span<const RoomToBalance> rooms, std::uint64_t self,
                                        std::span<const ServerStatus> servers, std::int64_t now_ns) {
  std::erase_if(sent_, [now_ns](const Sent& sent) { return now_ns >= sent.until_ns; });
  std::size_t characters = 0;
  for (const RoomToBalance& room : rooms) characters += room.characters;
  const auto share_of = [&](const RoomToBalance& room) {
    return used_share_ * static_cast<double>(room.characters) / static_cast<double>(characters);
  };
  const std::size_t givers = count_givers(self, servers);
  const auto takes = [&](const ServerStatus& server, const RoomToBalance& room) {
    // A server with a big room needs its time for that room, however free it looks now.
    if (server.id == self || server.draining || server.load.has_big_room) return false;
    if (room.is_big && server.load.rooms > 0) return false;
    double share = share_of(room);
    std::size_t added = room.characters;
    // The receiver's published load does not contain the rooms that were sent to it a moment ago. Without this sum, one
    // receiver would get room after room.
    for (const Sent& sent : sent_) {
      if (sent.to != server.id) continue;
      share += sent.share;
      added += sent.characters;
    }
    // Each giver may choose this receiver in the same second, and none of them knows of the others.
    return server.load.free_share - share * static_cast<double>(givers) >= kFreeShareAfter &&
           server.load.free_characters >= added * givers;
  };

  const RoomToBalance *const stays = largest_big(rooms), *chosen = nullptr;
  const auto is_enough = [&](const RoomToBalance& room) { return used_share_ - share_of(room) <= kUsedShareAfter; };
  const auto is_better = [&](const RoomToBalance& room) {
    if (!chosen) return true;
    if (is_enough(*chosen)) return is_enough(room) && room.characters < chosen->characters;
    return room.characters > chosen->characters;
  };
  for (const RoomToBalance& room : rooms) {
    // To move the only room would move the shortage with it.
    const bool is_only = room.characters == characters;
    if (room.characters == 0 || is_only || !room.has_stayed || &room == stays || !is_better(room)) continue;
    if (std::ranges::any_of(servers, [&](const ServerStatus& server) { return takes(server, room); })) chosen = &room;
  }
  if (!chosen) return {};

  std::vector<ServerStatus> takers;
  std::ranges::copy_if(servers, std::back_inserter(takers),
                       [&](const ServerStatus& server) { return takes(server, *chosen); });
  const std::optional<std::uint64_t> to = choose_server(chosen->name, takers, chosen->is_big);
  if (!to) return {};
  const double share = share_of(*chosen);
  sent_.push_back({.to = *to, .share = share, .characters = chosen->characters, .until_ns = now_ns + kArrival_ns});
  // The mean would take seconds to show the move, and a second room would follow meanwhile.
  used_share_ -= share;
  due_ns_ = now_ns + kShortOfTime_ns;
  return RoomMove{.room = std::string(chosen->name), .to = *to, .share = share};
}

}  // namespace hairnet::server
