#include "server/session/props_of_rooms.hpp"

#include <algorithm>
#include <limits>

namespace hairnet::server {

void PropsOfRooms::set(const std::string& room, const wire::SetProps& change, std::size_t room_count_max) {
  Props& props = rooms_[room].props;
  apply(change, props);
  // A room without props needs no entry: names of rooms that clients make up do not pile up here.
  if (props.empty()) rooms_.erase(room);
  if (rooms_.size() > room_count_max) forget_longest_empty();
}

std::vector<wire::Prop> PropsOfRooms::of_room(const std::string& room) const {
  std::vector<wire::Prop> all;
  if (const auto found = rooms_.find(room); found != rooms_.end()) {
    for (const auto& [number, prop] : found->second.props) all.push_back(prop);
  }
  return all;
}

std::size_t PropsOfRooms::count(const std::string& room) const {
  const auto found = rooms_.find(room);
  return found == rooms_.end() ? 0 : found->second.props.size();
}

void PropsOfRooms::open_room(const std::string& room) {
  if (const auto found = rooms_.find(room); found != rooms_.end()) found->second.ends_ns.reset();
}

void PropsOfRooms::close_room(const std::string& room, std::int64_t ends_ns) {
  if (const auto found = rooms_.find(room); found != rooms_.end()) found->second.ends_ns = ends_ns;
}

void PropsOfRooms::expire(std::int64_t now_ns) {
  std::erase_if(rooms_, [now_ns](const auto& room) { return room.second.ends_ns && *room.second.ends_ns <= now_ns; });
}

void PropsOfRooms::forget_longest_empty() {
  // Every room has the same time to end in, so that which ends first has been empty longest. Rooms with somebody in
  // them have no end and count as the last.
  const auto ends_first = std::ranges::min_element(rooms_, {}, [](const auto& room) {
    return room.second.ends_ns.value_or(std::numeric_limits<std::int64_t>::max());
  });
  if (ends_first != rooms_.end() && ends_first->second.ends_ns) rooms_.erase(ends_first);
}

}  // namespace hairnet::server
