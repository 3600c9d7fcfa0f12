#include "server/session/session_registry.hpp"

#include <sodium.h>

#include <algorithm>
#include <utility>

#include "core/assert.hpp"
#include "server/session/room_route.hpp"

namespace hairnet::server {
namespace {

// The tokens of all sessions, bans, and what empty rooms have, are checked this often.
constexpr std::int64_t kCheckInterval_ns = 1'000'000'000;
// Rooms without sessions are looked for this often.
constexpr std::int64_t kRoomsInterval_ns = 1'000'000'000;
// A draining server gives its rooms up this long after it has published that it drains, or sooner (drain). Meanwhile
// other servers make the grooms of these rooms ready, and all of them learn that this one drains, so that none sends a
// client back.
constexpr std::int64_t kNotice_ns = 500'000'000;
// free_memory() ends a session only if its outbox has at least this many bytes.
constexpr std::size_t kFreedLeast_bytes = std::size_t{1} << 20;

}  // namespace

// Each session stands in sessions_ under its own id, and session_count counts those that have joined.
void SessionRegistry::check_invariants() const {
  HAIRNET_ASSERT(context_->session_count <= sessions_.size());
#ifdef HAIRNET_VALIDATE_ON
  std::size_t joined = 0;
  for (const auto& [id, session] : sessions_) {
    HAIRNET_ASSERT(session && session->id() == id);
    HAIRNET_ASSERT(id != 0);
    joined += session->is_joined() ? 1 : 0;
  }
  HAIRNET_ASSERT(joined == context_->session_count);
#endif
}

PacketSink* SessionRegistry::open(std::shared_ptr<Connection> connection, std::int64_t now_ns) {
  HAIRNET_ASSERT(connection);
  if (draining_) {
    context_->counters.sessions_refused_full.add();
    connection->send(
        wire::encode_packet({now_ns, wire::Goodbye{wire::GoodbyeReason::server_draining, "the server stops"}}));
    connection->close(to_string(wire::GoodbyeReason::server_draining));
    return nullptr;
  }
  // An attacker may open connections and stay silent. The connection that has waited longest for its hello ends,
  // because an honest client sends its hello at once.
  if (context_->awaiting_hello_count >= context_->limits.session_count_max) end_silent(now_ns);
  // Numbers start again after the last one; 0 names no session.
  do {
    ++last_id_;
  } while (last_id_ == 0 || sessions_.contains(last_id_));
  const SessionId id = last_id_;
  auto session = std::make_unique<Session>(id, std::move(connection), *context_, now_ns);
  const auto [opened, is_new] = sessions_.emplace(id, std::move(session));
  HAIRNET_ASSERT(is_new);
  check_invariants();
  return opened->second.get();
}

void SessionRegistry::end_silent(std::int64_t now_ns) {
  Session* longest = nullptr;
  for (auto& [id, session] : sessions_) {
    if (session->state() != Session::State::awaiting_hello) continue;
    if (!longest || session->opened_ns() < longest->opened_ns()) longest = session.get();
  }
  if (!longest) return;
  context_->counters.sessions_refused_full.add();
  longest->drain(wire::GoodbyeReason::server_full, "too many connections wait for their welcome", now_ns);
}

Session* SessionRegistry::find_joined(SessionId id, const wire::SessionSecret& secret) {
  Session* const session = find(id);
  if (!session || !session->is_joined()) return nullptr;
  const wire::SessionSecret& expected = session->identity().secret;
  // The comparison takes the same time wherever the secrets differ, so its time tells nothing about the right one.
  return sodium_memcmp(expected.data(), secret.data(), expected.size()) == 0 ? session : nullptr;
}

SessionIdentity SessionRegistry::take_over(Session& former, Session& successor, std::int64_t now_ns) {
  const SessionId id = former.id();
  const auto found = sessions_.find(id);
  HAIRNET_ASSERT(found != sessions_.end() && found->second.get() == &former);
  HAIRNET_ASSERT(&former != &successor);
  // The successor moves to the place of the former session, under that number: to everyone else in the room the session
  // has never ended.
  auto node = sessions_.extract(successor.id());
  HAIRNET_ASSERT(!node.empty());
  SessionIdentity identity = former.release_identity(now_ns);
  HAIRNET_ASSERT(identity.id == id);
  // The former session lives until the next poll(), because the caller still has a reference to it.
  released_.push_back(std::exchange(found->second, std::move(node.mapped())));
  return identity;
}

bool SessionRegistry::end_detached(std::string_view token_holder, std::int64_t now_ns) {
  return end_longest_detached([&](const Session& s) { return s.identity().subject.token_holder == token_holder; },
                              now_ns);
}

bool SessionRegistry::end_empty(std::int64_t now_ns) {
  return end_longest_detached([](const Session& s) { return s.identity().characters.empty(); }, now_ns);
}

bool SessionRegistry::end_longest_detached(const std::function<bool(const Session&)>& is_meant, std::int64_t now_ns) {
  Session* longest = nullptr;
  for (auto& [id, session] : sessions_) {
    if (session->state() != Session::State::detached || !is_meant(*session)) continue;
    if (!longest || session->detached_since_ns() < longest->detached_since_ns()) longest = session.get();
  }
  if (longest) longest->end_detached(now_ns);
  return longest != nullptr;
}

std::vector<Session*> SessionRegistry::in_room(const std::string& room) {
  std::vector<Session*> found;
  for (auto& [id, session] : sessions_) {
    if (session->is_joined() && session->identity().room == room) found.push_back(session.get());
  }
  return found;
}

Session* SessionRegistry::find(SessionId id) {
  const auto found = sessions_.find(id);
  return found == sessions_.end() ? nullptr : found->second.get();
}

void SessionRegistry::flush(std::int64_t now_ns) {
  for (auto& [id, session] : sessions_) session->flush(now_ns);
}

void SessionRegistry::poll(std::int64_t now_ns) {
  // Sessions that have ended since the last poll are destroyed here, where none of their functions is on the stack.
  released_.clear();
  std::erase_if(sessions_, [](const auto& entry) { return entry.second->state() == Session::State::closed; });
  std::size_t detached = 0, packets_waiting = 0;
  check_invariants();
  if (context_->fleet) poll_fleet(now_ns);
  if (now_ns >= checks_due_ns_) {
    checks_due_ns_ = now_ns + kCheckInterval_ns;
    if (context_->token_key) {
      const std::int64_t unix_s = context_->unix_time_s();
      // Expiry and revocation are checked once a second: a token that ends between two checks is used for a second at
      // most.
      for (auto& [id, session] : sessions_) session->check_token(unix_s, now_ns);
    }
    context_->rules.expire(now_ns);
    context_->props.expire(now_ns);
  }
  for (auto& [id, session] : sessions_) {
    session->poll(now_ns);
    detached += session->state() == Session::State::detached ? 1 : 0;
    packets_waiting += session->outbox().packet_count();
  }
  SessionGauges& gauges = context_->counters.gauges;
  gauges.clients.set(static_cast<double>(sessions_.size()));
  gauges.clients_detached.set(static_cast<double>(detached));
  gauges.subjects.set(static_cast<double>(context_->subjects.size()));
  gauges.bans.set(static_cast<double>(context_->rules.entry_count()));
  gauges.packets_waiting.set(static_cast<double>(packets_waiting));
}

void SessionRegistry::free_memory(std::int64_t now_ns) {
  Session* largest = nullptr;
  // Ending a session that holds little would cost a client its room and free nothing.
  std::size_t most = kFreedLeast_bytes;
  for (auto& [id, session] : sessions_) {
    const std::size_t bytes = session->outbox().bytes_waiting();
    if (bytes < most) continue;
    most = bytes;
    largest = session.get();
  }
  if (largest) largest->end_for_memory(now_ns);
}

void SessionRegistry::drain(std::int64_t send_on_ns, std::int64_t now_ns) {
  draining_ = true;
  if (!context_->fleet || send_on_ns <= 0) return end_all(now_ns);
  send_on_until_ns_ = now_ns + send_on_ns;
  give_up_at_ns_ = now_ns + std::min(kNotice_ns, send_on_ns / 2);
  // pass_on() comes first, because drain() publishes the grooms together with the fact that this server drains.
  context_->fleet->pass_on(context_->grooms.in_use());
  context_->fleet->drain(now_ns);
  context_->fleet->poll(now_ns);
  send_on(now_ns);
}

void SessionRegistry::give_up_rooms(std::int64_t now_ns) {
  const std::vector<std::string> rooms = context_->fleet->own_rooms();
  if (rooms.empty()) return;
  // Changes of the last second are stored before the release, which writes a room's newest text in its own transaction.
  keeper_.keep_changed(now_ns);
  for (const std::string& room : rooms) {
    const auto known = empty_rooms_.find(room);
    const bool was_used =
        context_->rooms_left.contains(room) || (known != empty_rooms_.end() && known->second.was_used);
    // An empty room ends here, although its grace time has not passed: only its bans move on. The text of a room that
    // nobody has entered stays as its earlier owner has stored it.
    if (was_used && context_->rooms.count(room).sessions == 0) keeper_.end(room, now_ns);
    context_->fleet->release(room, now_ns);
  }
  context_->fleet->poll(now_ns);
}

void SessionRegistry::end_all(std::int64_t now_ns) {
  for (auto& [id, session] : sessions_) session->drain(wire::GoodbyeReason::server_draining, "", now_ns);
}

void SessionRegistry::poll_fleet(std::int64_t now_ns) {
  // The sessions are gathered first: one that resumes another's identity changes the map.
  std::vector<Session*> waiting;
  for (auto& [id, session] : sessions_) {
    if (session->waits_for_room()) waiting.push_back(session.get());
  }
  for (Session* session : waiting) session->retry_hello(now_ns);
  if (send_on_until_ns_ != 0) return send_on(now_ns);
  if (now_ns < rooms_due_ns_) return;
  rooms_due_ns_ = now_ns + kRoomsInterval_ns;
  keeper_.keep_changed(now_ns);
  release_empty_rooms(now_ns);
}

void SessionRegistry::release_empty_rooms(std::int64_t now_ns) {
  std::map<std::string, EmptyRoom> empty;
  for (const std::string& room : context_->fleet->own_rooms()) {
    const bool was_left = context_->rooms_left.contains(room);
    // Only empty rooms are remembered. A room that fills and empties again is in rooms_left, so its time begins again.
    if (context_->rooms.count(room).sessions > 0) continue;
    const auto known = empty_rooms_.find(room);
    EmptyRoom one = known == empty_rooms_.end() ? EmptyRoom{now_ns} : known->second;
    if (was_left) one = {now_ns, context_->room_grace_ns, true};
    // A lock that has come with a room would move from server to server forever if nobody may enter the room any more.
    // So it ends if the room's former members do not come back within kReturn_ns.
    const bool is_locked = context_->rules.is_locked(room);
    const std::int64_t min_ns = is_locked && !one.was_used ? RoomKeeper::kReturn_ns : kRoomsInterval_ns;
    if (now_ns - one.since_ns <= std::max(one.grace_ns, min_ns)) {
      empty[room] = one;
      continue;
    }
    // A room that nobody has entered stays as its earlier owner has left it.
    if (one.was_used || is_locked) keeper_.end(room, now_ns);
    release(room, now_ns);
  }
  empty_rooms_ = std::move(empty);
  context_->rooms_left.clear();
}

void SessionRegistry::release(const std::string& room, std::int64_t now_ns) {
  context_->fleet->release(room, now_ns);
  context_->rules.forget(room);
  context_->props.forget(room);
}

void SessionRegistry::send_on(std::int64_t now_ns) {
  // The rooms are given up at each poll: a claim may have been under way when the drain began. A poll that comes late
  // gives up the rooms before it ends the sessions.
  if (now_ns >= give_up_at_ns_) give_up_rooms(now_ns);
  if (now_ns >= send_on_until_ns_) {
    send_on_until_ns_ = 0;
    return end_all(now_ns);
  }
  // Each room is looked up once a poll, however many sessions it has.
  std::map<std::string, RoomRoute> routes;
  for (auto& [id, session] : sessions_) {
    if (session->state() != Session::State::active) continue;
    const std::string& room = session->identity().room;
    const auto [found, is_new] = routes.try_emplace(room);
    if (is_new) found->second = route_to_room(*context_->fleet, room, 0, now_ns);
    if (found->second.kind == RoomRoute::Kind::elsewhere) session->send_away(found->second.address, now_ns);
  }
}

void SessionRegistry::hand_over(const std::string& room, std::uint64_t to, std::int64_t now_ns) {
  keeper_.keep_changed(now_ns);
  context_->fleet->hand_over(room, to, now_ns);
  context_->fleet->poll(now_ns);
}

void SessionRegistry::on_room_lost(const std::string& room, std::int64_t now_ns) {
  context_->winds.erase(room);
  context_->props.forget(room);
  context_->rooms_changed.erase(room);
  const std::vector<Session*> sessions = in_room(room);
  // The place of an empty room is not asked for, because route_to_room() might claim it.
  if (sessions.empty()) return context_->rules.forget(room);
  const RoomRoute route = route_to_room(*context_->fleet, room, 0, now_ns);
  const ServerAddress to = route.kind == RoomRoute::Kind::elsewhere ? route.address : ServerAddress{};
  for (Session* session : sessions) {
    if (session->state() == Session::State::detached)
      session->end_detached(now_ns);
    else
      session->send_away(to, now_ns);
  }
}

}  // namespace hairnet::server
