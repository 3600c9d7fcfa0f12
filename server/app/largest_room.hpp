#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace hairnet::server {

// The room of a server that has the most characters, and what the server's ticks take.
struct RoomLoad {
  // The name of the room; empty: there is none.
  std::string room;
  std::size_t room_characters = 0, characters = 0;
  // A tick wants this time, with all characters at the level that their owners ask for.
  double wanted_s = 0;
  // A tick has this time; zero: it is not measured.
  double available_s = 0;
  // Not even the coarsest levels of all characters fit.
  bool is_over = false;
};

// Whether the largest room of this server needs the server alone, and whether not even that is enough. Characters are
// taken to cost alike. I/O thread.
class LargestRoom {
 public:
  // `own_server_share`: a room that wants more of the server's time gets no other rooms beside it.
  explicit LargestRoom(double own_server_share) : own_server_share_(own_server_share) {}

  void observe(const RoomLoad& load, std::int64_t now_ns);
  [[nodiscard]] bool needs_own_server() const { return needs_own_server_; }
  [[nodiscard]] bool needs_own_server(const std::string& room) const { return needs_own_server_ && room == room_; }
  // The room that takes no new clients, since the server has no time for them; empty: none.
  [[nodiscard]] const std::string& overloaded() const { return overloaded_; }

 private:
  double own_server_share_;
  // The largest room at the last observe().
  std::string room_;
  bool needs_own_server_ = false;
  std::string overloaded_;
  // The last observe() at which overloaded_ did not fit the server was at this time.
  std::int64_t over_ns_ = 0;
};

}  // namespace hairnet::server
