#pragma once

#include <cstdint>

#include "core/world/simulation_inputs.hpp"

namespace hairnet::server {

// A session's number, counted from 1 as connections come; 0 names no session. The registry skips numbers that are in
// use.
using SessionId = std::uint32_t;

// Names a character among those of all sessions, and in recordings: session id << 32 | the client's number.
using hairnet::CharacterKey;

// A client numbers its characters by itself, so two clients may use the same number. The session in the upper half
// keeps them apart, and makes the characters of one session adjacent in an ordered map (Rooms::close relies on this).
constexpr CharacterKey character_key(SessionId session, std::uint32_t number) {
  return static_cast<CharacterKey>(session) << 32 | number;
}
constexpr SessionId session_of(CharacterKey key) {
  return static_cast<SessionId>(key >> 32);
}
constexpr std::uint32_t number_of(CharacterKey key) {
  return static_cast<std::uint32_t>(key);
}
static_assert(session_of(character_key(3, ~0u)) == 3 && number_of(character_key(~0u, 7)) == 7);

}  // namespace hairnet::server
