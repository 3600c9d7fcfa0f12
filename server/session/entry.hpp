#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "server/session/session.hpp"

namespace hairnet::server {

// What comes of a hello.

// The client may join the room, with these claims of its token.
struct Joins {
  std::optional<channel::TokenClaims> claims;
};
// It comes back to this session, with the claims of its new token.
struct Resumes {
  Session* former = nullptr;
  std::optional<channel::TokenClaims> claims;
};
// No server has the room yet: ask again at the next poll.
struct WaitsForRoom {};
struct BelongsElsewhere {
  ServerAddress to;
};
// It does not get in. Where `error` says why, it is sent before the goodbye.
struct KeptOut {
  wire::GoodbyeReason reason = wire::GoodbyeReason::server_full;
  // One line for the client and the log.
  std::string detail;
  Refused error = {};
};
using EntryOutcome = std::variant<Joins, Resumes, WaitsForRoom, BelongsElsewhere, KeptOut>;

// Decides where the client of a hello belongs, and counts why it does not get in. The decision itself does not enter
// the room: the caller does (MessageHandler::follow). A new client's identity gets its name, room, role and subject;
// detached sessions that give way to it end. Once it joins, a command of entry_weight() fits into the queue.
EntryOutcome decide_entry(const wire::Hello& hello, SessionIdentity& identity, SessionContext& context,
                          const Connection& connection, std::int64_t now_ns);

// Weighs the command that tells the tick of a session. The room's props count, and its members: each is announced to
// the session, over several ticks if there are many.
std::size_t entry_weight(const SessionContext& context, const std::string& room);

}  // namespace hairnet::server
