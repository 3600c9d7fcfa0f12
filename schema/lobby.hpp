#pragma once

#include <string_view>

namespace hairnet::wire {

inline constexpr std::string_view kLobby = "lobby";

// The one name of the room that a client or a token names. The lobby has two names: the empty one and "lobby".
constexpr std::string_view room_of(std::string_view name) {
  return name.empty() ? kLobby : name;
}

}  // namespace hairnet::wire
