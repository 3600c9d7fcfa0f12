#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <unordered_map>
#include <vector>

#include "core/geometry/rigid_transform.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::load {

// The changes of props that all clients of a run have sent. A client that is shown a change finds here when it was
// sent, since messages about props have no time of their own.
class SentProps {
 public:
  // The number of changes of each prop that a client has been shown, by the prop's number; zero where it has none.
  using Seen = std::unordered_map<std::uint8_t, std::uint64_t>;

  // The client sends a change to its room.
  void add(std::uint32_t room, std::uint32_t client, std::int64_t sent_ns, const wire::SetProps& change);
  // Returns all changes until now, of which a client that has just been welcomed is to learn none one by one.
  [[nodiscard]] Seen until_now(std::uint32_t room) const;
  // Returns when those changes were sent that `announced` is the first to show to the client, and notes them in `seen`.
  // Its own changes are left out. A change that was replaced before the server announced it is shown by its successor.
  [[nodiscard]] std::vector<std::int64_t> show(std::uint32_t room, std::uint32_t client,
                                               const wire::RoomProps& announced, Seen& seen) const;

 private:
  struct Change {
    std::uint32_t client = 0;
    std::int64_t sent_ns = 0;
    // The place as the wire rounds it; nothing where the prop was removed.
    std::optional<Vec3f> place;
  };
  // The newest changes of one prop, and how many there were before them.
  struct History {
    std::uint64_t forgotten = 0;
    std::deque<Change> changes;
  };
  static void add(Change change, History& to);
  static void show(const History& history, std::uint32_t client, const std::optional<Vec3f>& place, std::uint64_t& seen,
                   std::vector<std::int64_t>& sent_ns);

  // By the number of the room and that of the prop.
  std::unordered_map<std::uint32_t, std::map<std::uint8_t, History>> rooms_;
};

}  // namespace hairnet::load
