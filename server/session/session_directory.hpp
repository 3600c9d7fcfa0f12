#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "schema/channel/token.hpp"
#include "schema/wire/messages.hpp"
#include "server/exchange/character_key.hpp"
#include "server/session/session_limits.hpp"
#include "server/session/subject.hpp"
#include "server/threading/token_bucket.hpp"

namespace hairnet::server {

class Session;

// A character as its session knows it. The tick has the rest of it (server/room/character.hpp).
struct OwnCharacter {
  wire::GroomHash groom{};
  // The newest sequence number of a valid pose; earlier poses that a client repeats are recognized by it.
  std::optional<std::uint32_t> pose_sequence = {};
  // The last pose that reached the tick was captured at this server time; poses too close to it are left out.
  std::optional<std::int64_t> pose_ns = {};
  // A pose that was left out had a teleport: the next pose that goes on carries it.
  bool teleport_pending = false;
};

// The part of a session that survives its connection and moves to the session that resumes it. The token buckets move
// with it: otherwise a client could refill them by reconnecting.
struct SessionIdentity {
  SessionIdentity(const SessionLimits& limits, std::int64_t now_ns)
      : messages(limits.messages_per_s, limits.messages_burst, now_ns),
        poses(limits.poses_per_s, limits.poses_burst, now_ns) {}

  SessionId id = 0;
  // Random bytes that the client got in Welcome and shows to resume. Whoever knows them can take the session over,
  // where tokens are needed with a token of the same subject.
  wire::SessionSecret secret{};
  // Hello.trace of its newest connection: a number by which logs of client and servers can be joined.
  std::uint64_t trace = 0;
  std::string name, room;
  wire::Role role = wire::Role::participant;
  Subject subject;
  // The claims of the session's newest token; none when the server needs no token.
  std::optional<channel::TokenClaims> claims;
  std::size_t character_count_max = 0;
  // The tick was told that the session may touch hair of others.
  bool touches_others = true;
  // By the number that the client has given the character.
  std::unordered_map<std::uint32_t, OwnCharacter> characters;
  // The rates of messages and of poses (README.md, "Prices").
  TokenBucket messages, poses;
  // The session was last resumed at this time; none: never.
  std::optional<std::int64_t> resumed_ns;
};

// Finds the session that a new connection resumes, and those of a room. I/O thread.
class SessionDirectory {
 public:
  virtual ~SessionDirectory() = default;
  // Null when no session of that number has joined, or the secret is wrong.
  virtual Session* find_joined(SessionId id, const wire::SessionSecret& secret) = 0;
  // Replaces `former`, which has joined, by `successor` and returns its identity. A connection that `former` still has
  // is closed.
  virtual SessionIdentity take_over(Session& former, Session& successor, std::int64_t now_ns) = 0;
  // Ends the session of this token holder that has been detached longest. False when the holder has no detached
  // session.
  virtual bool end_detached(std::string_view token_holder, std::int64_t now_ns) = 0;
  // Ends the session without characters that has been detached longest: its client loses little when it comes back.
  // False when there is none.
  virtual bool end_empty(std::int64_t now_ns) = 0;
  // The sessions that have joined the room, detached ones included.
  virtual std::vector<Session*> in_room(const std::string& room) = 0;
};

}  // namespace hairnet::server
