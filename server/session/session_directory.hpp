#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <unordered_map>

#include "schema/wire/messages.hpp"
#include "server/room/character_key.hpp"

namespace hairnet::server {

class Session;

// What of a session outlives its connection.
struct SessionIdentity {
  SessionId id = 0;
  wire::SessionSecret secret{};
  std::string name, room;
  wire::Role role = wire::Role::participant;
  std::size_t character_count_max = 0;
  // Of all grooms together; the server's own limit holds as well.
  std::uint64_t strand_count_max = std::numeric_limits<std::uint64_t>::max();
  std::unordered_map<std::uint32_t, wire::GroomHash> characters;
};

// Where a session that greets with another's secret becomes that one. I/O thread.
class SessionDirectory {
 public:
  virtual ~SessionDirectory() = default;
  // `heir` takes the place of the session `id`, whose connection is lost or ends with this; none when there is no such
  // session or the secret is another's.
  virtual std::optional<SessionIdentity> take_over(Session& heir, SessionId id, const wire::SessionSecret& secret,
                                                   std::int64_t now_ns) = 0;
};

}  // namespace hairnet::server
