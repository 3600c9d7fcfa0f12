#include "server/session/verify_token.hpp"

#include <utility>

namespace hairnet::server {

using wire::ErrorReason;

Refused verify_token(const SessionContext& context, std::string_view token, std::string_view room, wire::Role role,
                     std::optional<channel::TokenClaims>& claims) {
  if (!context.token_key) return {};
  auto verified = channel::verify(token, *context.token_key, context.unix_time_s(), room);
  if (!verified)
    return {ErrorReason::token_invalid, channel::explain(verified.error(), token, *context.token_key, room)};
  // The list is asked after the signature: only a genuine token's names mean anything.
  if (context.revoked_tokens.contains(*verified)) return {ErrorReason::token_invalid, kTokenRevoked};
  // A token may give less than the client asks for, never more; a participant's token lets its holder observe, too.
  if (verified->role == wire::Role::observer && role == wire::Role::participant)
    return {ErrorReason::token_invalid, "the token lets its holder observe only"};
  claims = std::move(*verified);
  return {};
}

}  // namespace hairnet::server
