#pragma once

#include <cstddef>
#include <map>
#include <string>

namespace hairnet::server {

// How many sessions and characters each room has, for limits. I/O thread.
class RoomCensus {
 public:
  struct Count {
    std::size_t sessions = 0, characters = 0;
  };
  [[nodiscard]] std::size_t room_count() const { return rooms_.size(); }
  [[nodiscard]] Count count(const std::string& room) const {
    const auto found = rooms_.find(room);
    return found == rooms_.end() ? Count{} : found->second;
  }
  void enter(const std::string& room) { ++rooms_[room].sessions; }
  void leave(const std::string& room, std::size_t characters) {
    const auto found = rooms_.find(room);
    if (found == rooms_.end()) return;
    found->second.characters -= characters;
    if (--found->second.sessions == 0) rooms_.erase(found);
  }
  void add_character(const std::string& room) { ++rooms_[room].characters; }
  void remove_character(const std::string& room) { --rooms_[room].characters; }

 private:
  std::map<std::string, Count> rooms_;
};

}  // namespace hairnet::server
