#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>

#include "schema/channel/token.hpp"
#include "schema/wire/messages.hpp"
#include "server/exchange/character_key.hpp"
#include "server/session/subject.hpp"

namespace hairnet::server {

class Session;

// The part of a session that survives its connection and moves to the session that resumes it.
struct SessionIdentity {
  SessionId id = 0;
  wire::SessionSecret secret{};
  std::string name, room;
  wire::Role role = wire::Role::participant;
  Subject subject;
  std::optional<channel::TokenClaims> claims;  // of its newest token; none when the server needs no token
  std::size_t character_count_max = 0;
  std::unordered_map<std::uint32_t, wire::GroomHash> characters;
};

// Finds the session that a new connection resumes. I/O thread.
class SessionDirectory {
 public:
  virtual ~SessionDirectory() = default;
  // The session that can be resumed with this secret; null when there is no such session or the secret is wrong.
  [[nodiscard]] virtual const SessionIdentity* find(SessionId id, const wire::SessionSecret& secret) const = 0;
  // Replaces the session `id`, which find() has found, by `successor` and returns its identity. A connection that the
  // session still has is closed.
  virtual SessionIdentity take_over(Session& successor, SessionId id, std::int64_t now_ns) = 0;
  // Ends the session of this bearer that has been detached longest. False when the bearer has no detached session.
  virtual bool end_detached(std::string_view bearer, std::int64_t now_ns) = 0;
};

}  // namespace hairnet::server
