#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/session/session.hpp"

namespace hairnet::server {

// Why the token does not let a client into the room in that role; else sets its claims, if the server needs a token.
Refused verify_token(const SessionContext& context, std::string_view token, std::string_view room, wire::Role role,
                     std::optional<channel::TokenClaims>& claims);

}  // namespace hairnet::server
