#pragma once

#include "server/session/session.hpp"

namespace hairnet::server {

// What a session may do in its room: as its token says, else as its role or the server's settings let it. A mute takes
// all of this away. I/O thread.
bool may_set_wind(const SessionIdentity& identity, const SessionContext& context);
bool may_set_props(const SessionIdentity& identity, const SessionContext& context);
bool may_touch_others(const SessionIdentity& identity);

// Whether a moderator has muted the session's subject in its room.
bool is_muted(const SessionIdentity& identity, const SessionContext& context);

}  // namespace hairnet::server
