#include "server/session/entry.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "core/assert.hpp"
#include "schema/lobby.hpp"
#include "server/session/moderation.hpp"
#include "server/session/room_route.hpp"
#include "server/session/verify_token.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

using wire::ErrorReason;
using wire::GoodbyeReason;

// A client follows at most this many redirects in a row; then it waits and begins again (PROTOCOL.md, fleets).
constexpr unsigned kRedirectsMax = 4;

// The outcome that refuses a client with an Error before the goodbye.
KeptOut refused(GoodbyeReason reason, Refused error) {
  HAIRNET_ASSERT(error);
  std::string detail = error.detail;
  return {reason, std::move(detail), std::move(error)};
}

// Decides about one hello. Each check_...() returns the refusal, or none where the client may pass. check_subject() and
// check_server() may end a detached session in favour of this client.
class Entry {
 public:
  using Claims = std::optional<channel::TokenClaims>;
  using Obstacle = std::optional<KeptOut>;

  Entry(const wire::Hello& hello, SessionIdentity& identity, SessionContext& context, const Connection& connection,
        std::int64_t now_ns)
      : hello_(hello),
        identity_(identity),
        context_(context),
        counters_(context.counters),
        connection_(connection),
        now_ns_(now_ns) {}

  // A resume comes first: its room is that of the session, whatever the hello names. The fleet comes second, because
  // the limits of another server are not this server's to check.
  EntryOutcome decide() {
    if (Session* const former = find_former()) return resume(*former);
    if (auto other = find_other_place()) return std::move(*other);
    return join();
  }

 private:
  // Null when there is nothing to resume: the client gets a new session.
  Session* find_former() const {
    if (hello_.session == 0 || !context_.directory) return nullptr;
    // A number beyond SessionId would be cut to another session's number.
    Session* const former = hello_.session <= std::numeric_limits<SessionId>::max()
                                ? context_.directory->find_joined(static_cast<SessionId>(hello_.session), hello_.secret)
                                : nullptr;
    if (!former) counters_.sessions_not_resumed.add();
    return former;
  }

  // The client has the number and the secret of a session. Its token, bans and the command queue still decide.
  EntryOutcome resume(Session& former) {
    const SessionIdentity& found = former.identity();
    // A resume announces the whole room to the client again. Without this interval a client could cause that at each
    // reconnection.
    if (found.resumed_ns && now_ns_ - *found.resumed_ns < context_.limits.resume_interval_ns) {
      counters_.sessions_refused_early.add();
      return KeptOut{GoodbyeReason::over_rate, "the session was resumed a moment ago; try again later"};
    }
    HAIRNET_ASSERT(found.claims.has_value() == context_.token_key.has_value());
    Claims claims;
    // The secret alone is not enough: the token may have expired or been revoked since, and a new one must name the
    // same subject. Otherwise a stolen secret would let one user act under another's quotas and bans.
    Refused error = verify_token(context_, hello_.token, found.room, found.role, claims);
    if (!error && claims && subject_name(*claims) != subject_name(*found.claims))
      error = {ErrorReason::token_invalid, "the token is not of the session's subject"};
    if (error) return refuse_token(std::move(error));
    if (Obstacle ban = check_ban(found.room, found.subject, claims)) return std::move(*ban);
    if (Obstacle queue = check_queue(found.room)) return std::move(*queue);
    return Resumes{&former, std::move(claims)};
  }

  // Returns the outcome when the room is not, or not yet, this server's; none when it is, or when join() will refuse
  // the hello. The token is verified before the directory is asked, because route_to_room() may claim the room: a
  // client without a valid token must not make a server claim rooms.
  std::optional<EntryOutcome> find_other_place() {
    const std::string room(wire::room_of(hello_.room));
    Claims claims;
    if (!context_.fleet || !wire::is_room_name(room) || verify_token(context_, hello_.token, room, hello_.role, claims))
      return std::nullopt;
    RoomRoute route = route_to_room(*context_.fleet, room, hello_.redirects, now_ns_);
    switch (route.kind) {
      case RoomRoute::Kind::here:
        return std::nullopt;
      case RoomRoute::Kind::elsewhere:
        if (hello_.redirects >= kRedirectsMax) note_redirect_loop(room, route.address);
        return BelongsElsewhere{std::move(route.address)};
      case RoomRoute::Kind::wait:
        return WaitsForRoom{};
      case RoomRoute::Kind::unavailable:
        break;
    }
    counters_.sessions_refused_fleet.add();
    return KeptOut{GoodbyeReason::server_full, std::move(route.reason)};
  }
  // The client does not follow a redirect after kRedirectsMax of them, but waits and begins again at the server that it
  // asked first.
  void note_redirect_loop(const std::string& room, const ServerAddress& to) {
    counters_.redirect_loops.add();
    spdlog::info("event=redirect_loop session={} room={} to={}:{}", identity_.id, log_text(room), to.host, to.port);
  }

  // The client asks for a new session in a room of this server.
  EntryOutcome join() {
    identity_.name = hello_.client_name;
    identity_.room = wire::room_of(hello_.room);
    identity_.role = hello_.role;
    // check_subject() and check_server() may end another session, so they come late: a client that is refused anyway,
    // such as a stranger without a token, ends nobody's session.
    if (Obstacle room = check_room()) return std::move(*room);
    Claims claims;
    if (Refused error = verify_token(context_, hello_.token, identity_.room, hello_.role, claims))
      return refuse_token(std::move(error));
    identity_.subject = subject_of(claims, hello_.token, connection_.network());
    if (Obstacle ban = check_ban(identity_.room, identity_.subject, claims)) return std::move(*ban);
    if (Obstacle lock = check_lock(claims)) return std::move(*lock);
    // The queue comes after the subject: a detached session that gives way puts a command into the queue.
    if (Obstacle subject = check_subject()) return std::move(*subject);
    if (Obstacle full = check_server()) return std::move(*full);
    if (Obstacle queue = check_queue(identity_.room)) return std::move(*queue);
    return Joins{std::move(claims)};
  }

  Obstacle check_server() {
    const SessionLimits& limits = context_.limits;
    // When the server is full, a detached session without characters ends in favour of the new client: its own client
    // may not come back, and loses little.
    if (context_.session_count >= limits.session_count_max &&
        !(context_.directory && context_.directory->end_empty(now_ns_))) {
      counters_.sessions_refused_full.add();
      return KeptOut{GoodbyeReason::server_full,
                     "the server is full: at most " + std::to_string(limits.session_count_max) + " clients"};
    }
    if (!context_.is_memory_full()) return std::nullopt;
    counters_.sessions_refused_memory.add();
    return KeptOut{GoodbyeReason::server_full, kMemoryFull};
  }

  // Checks the name of the room, the number of rooms and the number of sessions in this room.
  Obstacle check_room() {
    const SessionLimits& limits = context_.limits;
    Refused error;
    const CountsByName::Count room = context_.rooms.count(identity_.room);
    // Only a new name needs a place: rooms that exist stay open to others when the server has its maximum.
    if (!wire::is_room_name(identity_.room))
      error = {ErrorReason::room_invalid, wire::kRoomNameRule};
    else if (room.sessions == 0 && context_.rooms.size() >= limits.room_count_max)
      error = {ErrorReason::limit_exceeded,
               "the server is full: at most " + std::to_string(limits.room_count_max) + " rooms"};
    else if (room.sessions >= limits.sessions_per_room_max)
      error = {ErrorReason::limit_exceeded,
               "the room is full: at most " + std::to_string(limits.sessions_per_room_max) + " clients"};
    if (!error) return std::nullopt;
    counters_.sessions_refused_room.add();
    return refused(GoodbyeReason::room_refused, std::move(error));
  }

  Obstacle check_ban(const std::string& room, const Subject& subject, const Claims& claims) {
    // A ban binds the subject. Where tokens name no subject, that is the address, and everyone behind it is banned.
    if (is_moderator(claims) || !context_.rules.is_banned(room, subject.name, now_ns_)) return std::nullopt;
    counters_.sessions_refused_banned.add();
    return KeptOut{GoodbyeReason::removed, "a moderator has removed this user from the room for some time"};
  }

  Obstacle check_lock(const Claims& claims) {
    if (context_.rules.is_locked(identity_.room) && !is_moderator(claims) &&
        !context_.rules.may_return(identity_.room, identity_.subject.name, now_ns_)) {
      counters_.sessions_refused_locked.add();
      return refused(GoodbyeReason::room_refused, {ErrorReason::not_allowed, "a moderator has locked the room"});
    }
    // An overloaded room refuses new clients, and keeps those that it has.
    if (identity_.room != context_.overloaded_room) return std::nullopt;
    counters_.sessions_refused_overloaded.add();
    return refused(GoodbyeReason::room_refused, {ErrorReason::limit_exceeded, kRoomOverloaded});
  }

  // When a subject has too many sessions, its longest detached session ends first: the new client is probably the same
  // one, which has come back without its secret.
  Obstacle check_subject() {
    const Subject& subject = identity_.subject;
    if (subject.kind == Subject::Kind::exempt) return std::nullopt;
    const bool is_token = subject.kind == Subject::Kind::token;
    const SessionLimits& limits = context_.limits;
    // An address may be shared by many users behind one router, so its limit is larger and no detached session of it
    // gives way: that session may be another user's.
    const std::size_t most = is_token ? limits.sessions_per_subject_max : limits.sessions_per_address_max;
    while (context_.subjects.count(subject.name).sessions >= most) {
      if (is_token && context_.directory && context_.directory->end_detached(subject.token_holder, now_ns_)) continue;
      (is_token ? counters_.sessions_refused_subject : counters_.sessions_refused_address).add();
      return KeptOut{GoodbyeReason::server_full, "at most " + std::to_string(most) +
                                                     (is_token ? " clients of one user" : " clients of one address")};
    }
    return std::nullopt;
  }

  // Checks whether the command that opens the session fits the queue to the tick.
  Obstacle check_queue(const std::string& room) {
    if (context_.commands.fits(entry_weight(context_, room))) return std::nullopt;
    counters_.sessions_refused_busy.add();
    return KeptOut{GoodbyeReason::server_full, "the server is busy; try again"};
  }

  KeptOut refuse_token(Refused error) {
    counters_.sessions_refused_token.add();
    return refused(GoodbyeReason::token_refused, std::move(error));
  }

  const wire::Hello& hello_;
  SessionIdentity& identity_;
  SessionContext& context_;
  SessionCounters& counters_;
  const Connection& connection_;
  std::int64_t now_ns_;
};

}  // namespace

std::size_t entry_weight(const SessionContext& context, const std::string& room) {
  // The tick announces at most this many members to one observer at once (scheduler_commands.cpp); the others follow
  // later.
  constexpr std::size_t kCountedMax = 512;
  return 1 + context.props.count(room) + std::min(context.rooms.count(room).characters, kCountedMax);
}

EntryOutcome decide_entry(const wire::Hello& hello, SessionIdentity& identity, SessionContext& context,
                          const Connection& connection, std::int64_t now_ns) {
  return Entry(hello, identity, context, connection, now_ns).decide();
}

}  // namespace hairnet::server
