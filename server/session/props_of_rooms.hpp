#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/exchange/props.hpp"

namespace hairnet::server {

// The props that clients have set, by room: those who come to an empty room, or to its next server, find them. They
// last while the room exists, as it does in the tick. I/O thread.
class PropsOfRooms {
 public:
  // With more than `room_count_max` rooms, those of the room that has been empty longest are forgotten.
  void set(const std::string& room, const wire::SetProps& change, std::size_t room_count_max);
  // Their numbers ascend.
  [[nodiscard]] std::vector<wire::Prop> of_room(const std::string& room) const;
  [[nodiscard]] std::size_t count(const std::string& room) const;
  void forget(const std::string& room) { rooms_.erase(room); }

  // A session has entered: the props stay.
  void open_room(const std::string& room);
  // Nobody is left, and the room ends at `ends_ns` unless somebody enters before.
  void close_room(const std::string& room, std::int64_t ends_ns);
  // Forgets the props of rooms that have ended.
  void expire(std::int64_t now_ns);

 private:
  void forget_longest_empty();
  struct OfRoom {
    Props props;
    // The empty room ends then; none: someone is in it.
    std::optional<std::int64_t> ends_ns;
  };
  // Holds only rooms that have props.
  std::map<std::string, OfRoom> rooms_;
};

}  // namespace hairnet::server
