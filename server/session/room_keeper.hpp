#pragma once

#include <cstdint>
#include <string>

#include "server/session/session.hpp"

namespace hairnet::server {

// What belongs to a room of a fleet and moves with it: what moderators have decided, the wind and the props. It is kept
// as text in the directory, where the room's next owner finds it at its claim. I/O thread.
class RoomKeeper {
 public:
  // Those who were in a locked room may come back to it for this long at its next server.
  static constexpr std::int64_t kReturn_ns = 60'000'000'000;

  explicit RoomKeeper(SessionContext& context) : context_(&context) {}

  // Takes a room that this server has claimed: `text` is what its earlier owner has kept; empty: nothing. The text
  // comes from etcd, so it is validated like a client's message; what is invalid is counted and left out, and the room
  // opens without it.
  void take(const std::string& room, const std::string& text, std::int64_t now_ns);
  // Tells the directory of the rooms that have changed since the last call; at most once a second.
  void keep_changed(std::int64_t now_ns);
  // Before the release of a room that all have left: only its bans outlive it.
  void end(const std::string& room, std::int64_t now_ns);

 private:
  void keep(const std::string& room, bool has_ended, std::int64_t now_ns);

  SessionContext* context_;
};

}  // namespace hairnet::server
