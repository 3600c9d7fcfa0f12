#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/exchange/props.hpp"

namespace hairnet::server {

// The props that clients have set, by room, so that clients who come to an empty room, or to the room's next server,
// find the props. The tick has the props of its rooms, too; they are forgotten here when an empty room ends there. I/O
// thread.
class PropsOfRooms {
 public:
  // With more than `room_count_max` rooms, those of the room that has been empty longest are forgotten.
  void set(const std::string& room, const wire::SetProps& change, std::size_t room_count_max);
  // The props of the room, with ascending numbers.
  [[nodiscard]] std::vector<wire::Prop> of_room(const std::string& room) const;
  [[nodiscard]] std::size_t count(const std::string& room) const;
  void forget(const std::string& room) { rooms_.erase(room); }

  // A session has entered the room, so its props do not end.
  void open_room(const std::string& room);
  // The last session has left: the room ends at `ends_ns` unless a session enters before.
  void close_room(const std::string& room, std::int64_t ends_ns);
  // Forgets the props of rooms that have ended.
  void expire(std::int64_t now_ns);

 private:
  void forget_longest_empty();
  struct OfRoom {
    Props props;
    // The empty room ends at this time; none: a session is in it.
    std::optional<std::int64_t> ends_ns;
  };
  // Only rooms that have props have an entry.
  std::map<std::string, OfRoom> rooms_;
};

}  // namespace hairnet::server
