#pragma once

#include <cstdint>
#include <string>

#include "server/session/session.hpp"

namespace hairnet::server {

// Moves the state of a fleet's room to its next server: what moderators have decided, the wind and the props. The state
// is stored as text in the directory (Directory::keep), where the room's next owner finds it with its claim. I/O
// thread.
class RoomKeeper {
 public:
  // The members of a locked room may enter it for this long at its next server.
  static constexpr std::int64_t kReturn_ns = 60'000'000'000;

  explicit RoomKeeper(SessionContext& context) : context_(&context) {}

  // Takes a room that this server has claimed: `text` is what its earlier owner has kept; empty: nothing. The text
  // comes from etcd, so it is validated like a client's message; what is invalid is counted and left out, and the room
  // opens without it.
  void take(const std::string& room, const std::string& text, std::int64_t now_ns);
  // Stores the state of the rooms that have changed since the last call (SessionContext::rooms_changed). Call it at
  // most once a second.
  void keep_changed(std::int64_t now_ns);
  // Call it before the release of a room that all have left: stores only the room's bans, and forgets the rest.
  void end(const std::string& room, std::int64_t now_ns);

 private:
  // Stores the room's state in the directory; if it `has_ended`, only its bans.
  void keep(const std::string& room, bool has_ended, std::int64_t now_ns);

  SessionContext* context_;
};

}  // namespace hairnet::server
