#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "core/assert.hpp"

namespace hairnet::server {

// How many sessions and characters each room has, for limits. A room exists from its first enter() to its last leave();
// all other calls assert that it exists. I/O thread.
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
    HAIRNET_ASSERT(found != rooms_.end());
    HAIRNET_ASSERT(found->second.characters >= characters);
    found->second.characters -= characters;
    if (--found->second.sessions != 0) return;
    HAIRNET_ASSERT(found->second.characters == 0);
    rooms_.erase(found);
  }
  void add_character(const std::string& room) {
    const auto found = rooms_.find(room);
    HAIRNET_ASSERT(found != rooms_.end());
    ++found->second.characters;
  }
  void remove_character(const std::string& room) {
    const auto found = rooms_.find(room);
    HAIRNET_ASSERT(found != rooms_.end());
    HAIRNET_ASSERT(found->second.characters > 0);
    --found->second.characters;
  }

 private:
  std::map<std::string, Count> rooms_;
};

}  // namespace hairnet::server
