#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/session/session.hpp"

namespace hairnet::server {

// All sessions. I/O thread.
class SessionRegistry final : public SessionDirectory {
 public:
  explicit SessionRegistry(SessionContext& context) : context_(&context) { context.directory = this; }

  // Null when the server is draining: the connection then gets a Goodbye and is closed. The sink exists until the first
  // poll() after the connection is closed. When too many wait for their Welcome, the longest waiting one ends: silent
  // connections keep nobody out.
  PacketSink* open(std::shared_ptr<Connection> connection, std::int64_t now_ns);
  Session* find_joined(SessionId id, const wire::SessionSecret& secret) override;
  SessionIdentity take_over(Session& former, Session& successor, std::int64_t now_ns) override;
  bool end_detached(std::string_view bearer, std::int64_t now_ns) override;
  bool end_empty(std::int64_t now_ns) override;
  std::vector<Session*> in_room(const std::string& room) override;
  [[nodiscard]] Session* find(SessionId id);
  void flush(std::int64_t now_ns);
  void poll(std::int64_t now_ns);
  void drain(std::int64_t now_ns);  // all sessions, and refuses new ones
  // Ends the session for which most bytes wait, if that frees memory worth it.
  void free_memory(std::int64_t now_ns);
  [[nodiscard]] std::size_t count() const { return sessions_.size(); }
  [[nodiscard]] const std::map<SessionId, std::unique_ptr<Session>>& all() const { return sessions_; }

 private:
  void check_invariants() const;
  void end_silent(std::int64_t now_ns);  // the one that has waited longest for a hello
  // Ends the one that has been detached longest of those for which `is_meant` holds. False when there is none.
  bool end_longest_detached(const std::function<bool(const Session&)>& is_meant, std::int64_t now_ns);

  SessionContext* context_;
  std::map<SessionId, std::unique_ptr<Session>> sessions_;
  std::vector<std::unique_ptr<Session>> released_;  // until their connections are closed completely
  SessionId last_id_ = 0;
  std::int64_t tokens_due_ns_ = 0;  // when the tokens of all sessions are checked, and bans expire, next
  bool draining_ = false;
};

}  // namespace hairnet::server
