#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/session/room_keeper.hpp"
#include "server/session/session.hpp"

namespace hairnet::server {

// All sessions by id, and what concerns several of them: resumes, rooms of a fleet, the drain of the server, memory.
// I/O thread. A session that ends is erased in the next poll(), never at once, because its own functions may be on the
// stack.
class SessionRegistry final : public SessionDirectory {
 public:
  explicit SessionRegistry(SessionContext& context) : context_(&context), keeper_(context) { context.directory = this; }

  // Null when the server is draining: the connection then gets a Goodbye and is closed. The sink exists until the first
  // poll() after the connection is closed. When too many wait for their Welcome, the longest waiting one ends: silent
  // connections keep nobody out.
  PacketSink* open(std::shared_ptr<Connection> connection, std::int64_t now_ns);
  // These five implement SessionDirectory (session_directory.hpp).
  Session* find_joined(SessionId id, const wire::SessionSecret& secret) override;
  SessionIdentity take_over(Session& former, Session& successor, std::int64_t now_ns) override;
  bool end_detached(std::string_view token_holder, std::int64_t now_ns) override;
  bool end_empty(std::int64_t now_ns) override;
  std::vector<Session*> in_room(const std::string& room) override;
  // Null when no session has the number.
  [[nodiscard]] Session* find(SessionId id);
  // Sends what waits in all outboxes. The I/O thread calls it once the tick thread has woken it after a tick.
  void flush(std::int64_t now_ns);
  // Erases ended sessions, polls the others, checks tokens and rules once a second, and sets the gauges.
  void poll(std::int64_t now_ns);
  // Ends all sessions, and refuses new ones. In a fleet other servers first get half a second to hear of it and to make
  // the grooms in use ready. Then each room is given up, and its sessions are sent to the server that takes it,
  // `send_on_ns` after the call at the latest: until then they go on, without frames.
  void drain(std::int64_t send_on_ns, std::int64_t now_ns);
  // This server has got the room in the fleet's directory. `kept` is the text that the room's earlier owner has stored
  // (FleetEvent::kept).
  void on_room_claimed(const std::string& room, const std::string& kept, std::int64_t now_ns) {
    keeper_.take(room, kept, now_ns);
  }
  // Gives a room of this server up to the server with the id `to`. on_room_lost() follows.
  void hand_over(const std::string& room, std::uint64_t to, std::int64_t now_ns);
  // This server does not own the room any more: its sessions are sent to the room's next server.
  void on_room_lost(const std::string& room, std::int64_t now_ns);
  // Ends the session with the most bytes in its outbox, if these are at least 1 MiB (session_registry.cpp).
  void free_memory(std::int64_t now_ns);
  [[nodiscard]] std::size_t count() const { return sessions_.size(); }
  [[nodiscard]] const std::map<SessionId, std::unique_ptr<Session>>& all() const { return sessions_; }

 private:
  // A room of this server in a fleet that has no session. A room that nobody has entered has no grace time, so that
  // claims of random names do not pile up.
  struct EmptyRoom {
    std::int64_t since_ns = 0;
    // The room keeps its wind, props, mutes and lock for this long, in case somebody comes back.
    std::int64_t grace_ns = 0;
    // A session was in it, on this server.
    bool was_used = false;
  };
  void check_invariants() const;
  // Sends every session a goodbye: the server stops.
  void end_all(std::int64_t now_ns);
  // Retries hellos that wait for the directory, stores changed rooms there, and releases empty ones; or goes on with a
  // drain.
  void poll_fleet(std::int64_t now_ns);
  // Releases the rooms that have been empty for their grace time. It runs once a second.
  void release_empty_rooms(std::int64_t now_ns);
  // Releases the room in the directory, and forgets its rules and props.
  void release(const std::string& room, std::int64_t now_ns);
  // Releases all rooms of this server, while it drains in a fleet.
  void give_up_rooms(std::int64_t now_ns);
  // While the server drains in a fleet: sends the sessions whose rooms have been released to the rooms' next servers.
  void send_on(std::int64_t now_ns);
  // Ends the session that has waited longest for its hello.
  void end_silent(std::int64_t now_ns);
  // Among the detached sessions for which `is_meant` returns true, ends the one that has been detached longest. Returns
  // false when there is none.
  bool end_longest_detached(const std::function<bool(const Session&)>& is_meant, std::int64_t now_ns);

  SessionContext* context_;
  RoomKeeper keeper_;
  // Ordered by id, so that each poll visits sessions in the same order and a seed replays exactly.
  std::map<SessionId, std::unique_ptr<Session>> sessions_;
  // Sessions whose identity another session has taken over. The next poll() destroys them, because their functions may
  // be on the stack.
  std::vector<std::unique_ptr<Session>> released_;
  // The number of the newest session.
  SessionId last_id_ = 0;
  // At this time next, the tokens of all sessions are checked, and bans, and the rules and props of empty rooms,
  // expire.
  std::int64_t checks_due_ns_ = 0;
  // The rooms of this server without sessions, at the last release_empty_rooms().
  std::map<std::string, EmptyRoom> empty_rooms_;
  // release_empty_rooms() is due at this time.
  std::int64_t rooms_due_ns_ = 0;
  // While the server drains in a fleet: sessions that are still here at this time end. Zero: the server does not drain,
  // or they have ended.
  std::int64_t send_on_until_ns_ = 0;
  // The rooms are given up at this time, while draining in a fleet.
  std::int64_t give_up_at_ns_ = 0;
  bool draining_ = false;
};

}  // namespace hairnet::server
