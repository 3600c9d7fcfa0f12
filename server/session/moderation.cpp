#include "server/session/moderation.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

using wire::ErrorReason;
using wire::ModerateAction;

// Whom a message concerns: a subject, and its sessions in the moderator's room.
struct Target {
  std::string subject;
  std::vector<Session*> sessions;
};

// None when the message names a session that is not in the room, or nobody.
std::optional<Target> find_target(const wire::Moderate& request, const std::string& room,
                                  const SessionContext& context) {
  std::vector<Session*> in_room;
  if (context.directory) in_room = context.directory->in_room(room);
  if (request.session == 0) {
    if (request.subject.empty()) return std::nullopt;
    std::erase_if(in_room, [&](const Session* s) { return s->identity().subject.name != request.subject; });
    return Target{request.subject, std::move(in_room)};
  }
  const auto named = std::ranges::find(in_room, request.session, [](const Session* s) { return s->id(); });
  if (named == in_room.end()) return std::nullopt;
  const Subject subject = (*named)->identity().subject;
  // Everyone at an exempt address has the same subject, so that the session alone is meant.
  if (subject.kind == Subject::Kind::exempt) return Target{subject.name, {*named}};
  std::erase_if(in_room, [&](const Session* s) { return s->identity().subject.name != subject.name; });
  return Target{subject.name, std::move(in_room)};
}

// Removes the target from the room and bans it for request.seconds.
Refused remove(const wire::Moderate& request, const Target& target, const std::string& room, SessionContext& context,
               std::int64_t now_ns) {
  const std::int64_t until_ns = now_ns + std::int64_t{request.seconds} * 1'000'000'000;
  const bool was_banned = context.rules.is_banned(room, target.subject, now_ns);
  if (target.sessions.empty() && !was_banned && request.seconds == 0)
    return {ErrorReason::character_unknown, "nobody of that name is in the room or banned from it"};
  // The ban is stored before the sessions end, so that a client which comes back at once finds it. A time of zero
  // seconds removes the person without a ban, and ends an earlier one.
  if (!context.rules.ban(room, target.subject, until_ns, now_ns, context.limits.bans_max))
    return {ErrorReason::limit_exceeded, "the server has its maximum of bans, mutes and locks"};
  std::string detail = "a moderator has removed this user from the room";
  if (!request.reason.empty()) detail += ": " + request.reason;
  for (Session* session : target.sessions) {
    context.counters.sessions_closed_by_server_removed.add();
    session->drain(wire::GoodbyeReason::removed, detail, now_ns);
  }
  return {};
}

// Removes, mutes or unmutes a person, unless the person is a moderator.
Refused act_on_person(const wire::Moderate& request, const Target& target, const SessionIdentity& by,
                      SessionContext& context, std::int64_t now_ns) {
  // Everyone at an exempt address, such as the loopback, has one name: a ban or mute of it would hit all of them.
  const bool is_shared = target.subject == Subject().name;
  if (is_shared && !(request.action == ModerateAction::remove && request.session != 0 && request.seconds == 0))
    return {ErrorReason::not_allowed, "everyone at an exempt address has this name; only a session can be removed"};
  // Moderators cannot act against each other or themselves. A moderator who is not in the room is not recognized by
  // name here, but bans and mutes do not apply to moderators (Entry::check_ban, is_muted).
  const bool is_protected =
      (target.subject == by.subject.name && !is_shared) ||
      std::ranges::any_of(target.sessions, [](const Session* s) { return is_moderator(s->identity().claims); });
  if (is_protected) return {ErrorReason::not_allowed, "a moderator cannot be removed or muted"};
  if (request.action == ModerateAction::remove) return remove(request, target, by.room, context, now_ns);
  if (request.action == ModerateAction::unmute) {
    context.rules.unmute(by.room, target.subject);
  } else if (!context.rules.mute(by.room, target.subject, context.limits.bans_max)) {
    return {ErrorReason::limit_exceeded, "the server has its maximum of bans, mutes and locks"};
  }
  // The rights to set wind and props are checked when a client sends SetWind or SetProps. The tick checks the right to
  // touch, so the tick must get the change.
  for (Session* session : target.sessions) session->update_touch_right();
  return {};
}

Counter& counter_of(ModerateAction action, SessionCounters& counters) {
  switch (action) {
    case ModerateAction::remove:
      return counters.moderations_remove;
    case ModerateAction::mute:
      return counters.moderations_mute;
    case ModerateAction::unmute:
      return counters.moderations_unmute;
    case ModerateAction::lock:
      return counters.moderations_lock;
    case ModerateAction::unlock:
      break;
  }
  return counters.moderations_unlock;
}

}  // namespace

Refused moderate(const wire::Moderate& request, const SessionIdentity& by, SessionContext& context,
                 std::int64_t now_ns) {
  if (!is_moderator(by.claims)) return {ErrorReason::not_allowed, "this session may not moderate"};
  std::string subject;
  if (request.action == ModerateAction::lock) {
    if (!context.rules.lock(by.room, context.limits.bans_max))
      return {ErrorReason::limit_exceeded, "the server has its maximum of bans, mutes and locks"};
  } else if (request.action == ModerateAction::unlock) {
    context.rules.unlock(by.room);
  } else {
    const std::optional<Target> target = find_target(request, by.room, context);
    if (!target) return {ErrorReason::character_unknown, "no such session is in the room"};
    if (Refused refused = act_on_person(request, *target, by, context, now_ns)) return refused;
    subject = target->subject;
  }
  // The room's next server must know the rules: RoomKeeper writes them within a second.
  if (context.fleet) context.rooms_changed.insert(by.room);
  counter_of(request.action, context.counters).add();
  spdlog::info("event=moderated session={} action={} by={} target={} room={} seconds={} reason={}", by.id,
               to_string(request.action), log_text(by.subject.name), log_text(subject), log_text(by.room),
               request.seconds, log_text(request.reason));
  return {};
}

}  // namespace hairnet::server
