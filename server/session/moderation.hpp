#pragma once

#include <cstdint>

#include "server/session/session.hpp"

namespace hairnet::server {

// Whether the claims make a moderator. Bans, mutes and locks do not apply to moderators.
inline bool is_moderator(const std::optional<channel::TokenClaims>& claims) {
  return claims && claims->moderate;
}

// Does what a session asks for in its room, or returns why not. Logs and counts what is done. I/O thread.
Refused moderate(const wire::Moderate& request, const SessionIdentity& by, SessionContext& context,
                 std::int64_t now_ns);

}  // namespace hairnet::server
