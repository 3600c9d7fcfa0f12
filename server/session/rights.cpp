#include "server/session/rights.hpp"

#include <optional>

#include "server/session/moderation.hpp"

namespace hairnet::server {
namespace {

// What the token says decides; without such a claim the setting does. AllowedClients ascends, and each value includes
// those before it.
bool is_allowed(std::optional<bool> by_token, AllowedClients who, const SessionIdentity& identity) {
  if (by_token) return *by_token;
  if (is_moderator(identity.claims)) return who >= AllowedClients::moderators;
  if (identity.role == wire::Role::participant) return who >= AllowedClients::participants;
  return who == AllowedClients::everyone;
}

}  // namespace

bool may_set_wind(const SessionIdentity& identity, const SessionContext& context) {
  return is_allowed(identity.claims ? identity.claims->wind : std::nullopt, context.limits.wind_from_clients, identity);
}

bool may_set_props(const SessionIdentity& identity, const SessionContext& context) {
  return is_allowed(identity.claims ? identity.claims->props : std::nullopt, context.limits.props_from_clients,
                    identity);
}

// No setting has touch: a participant may touch unless its token says otherwise, and each owner decides for its own
// hair (TouchRule).
bool may_touch_others(const SessionIdentity& identity) {
  const bool by_role = identity.role == wire::Role::participant;
  return identity.claims ? identity.claims->touch.value_or(by_role) : by_role;
}

bool is_muted(const SessionIdentity& identity, const SessionContext& context) {
  return !is_moderator(identity.claims) && context.rules.is_muted(identity.room, identity.subject.name);
}

}  // namespace hairnet::server
