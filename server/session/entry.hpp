#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "server/session/session.hpp"

namespace hairnet::server {

// The five outcomes of a client's Hello follow.

// The client may join the room, with these claims of its token.
struct Joins {
  std::optional<channel::TokenClaims> claims;
};
// The client takes over the session `former`, with the claims of its new token.
struct Resumes {
  Session* former = nullptr;
  std::optional<channel::TokenClaims> claims;
};
// The directory does not know yet which server has the room: decide again at the next poll.
struct WaitsForRoom {};
// Another server has the room, or should claim it.
struct BelongsElsewhere {
  ServerAddress to;
};
// The client is refused. If there is an `error`, it is sent before the goodbye.
struct KeptOut {
  wire::GoodbyeReason reason = wire::GoodbyeReason::server_full;
  // One line for the client and the log.
  std::string detail;
  Refused error = {};
};
using EntryOutcome = std::variant<Joins, Resumes, WaitsForRoom, BelongsElsewhere, KeptOut>;

// Decides where the client of a hello belongs, and counts refusals by reason. The function does not enter the room: the
// caller does (MessageHandler::follow). It writes a new client's name, room, role and subject into `identity`, and ends
// detached sessions that give way to the client. If the outcome is Joins or Resumes, a command of entry_weight() fits
// into the queue.
EntryOutcome decide_entry(const wire::Hello& hello, SessionIdentity& identity, SessionContext& context,
                          const Connection& connection, std::int64_t now_ns);

// The weight in the command queue of the command that tells the tick of a session: 1, plus the props and the members of
// the room (512 at most), which the tick announces to the session.
std::size_t entry_weight(const SessionContext& context, const std::string& room);

}  // namespace hairnet::server
