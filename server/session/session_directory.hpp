#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <unordered_map>

#include "schema/wire/messages.hpp"
#include "server/exchange/character_key.hpp"

namespace hairnet::server {

class Session;

// The part of a session that survives its connection and moves to the session that resumes it.
struct SessionIdentity {
  SessionId id = 0;
  wire::SessionSecret secret{};
  std::string name, room;
  wire::Role role = wire::Role::participant;
  std::size_t character_count_max = 0;
  // Of all grooms together; the server's own limit applies too.
  std::uint64_t strand_count_max = std::numeric_limits<std::uint64_t>::max();
  std::unordered_map<std::uint32_t, wire::GroomHash> characters;
};

// Finds the session that a new connection resumes. I/O thread.
class SessionDirectory {
 public:
  virtual ~SessionDirectory() = default;
  // Replaces the session `id` by `successor` and returns its identity. A connection that the session still has is
  // closed. None when there is no such session or the secret is wrong.
  virtual std::optional<SessionIdentity> take_over(Session& successor, SessionId id, const wire::SessionSecret& secret,
                                                   std::int64_t now_ns) = 0;
};

}  // namespace hairnet::server
