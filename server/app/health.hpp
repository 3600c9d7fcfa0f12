#pragma once

#include <cstdint>
#include <string>

namespace hairnet::server {

// The state that /readyz reports. All times on the server's monotonic clock.
struct Health {
  bool accepting = false;         // the port is open
  bool draining = false;          // a signal has asked it to end
  bool memory_full = false;       // newcomers are refused
  bool in_fleet = true;           // may have rooms: its lease is valid, or it is a server on its own
  std::int64_t last_tick_ns = 0;  // when the newest tick ended; 0: none yet
  std::int64_t now_ns = 0;
};

inline constexpr std::int64_t kTickStallMax_ns = 1'000'000'000;

[[nodiscard]] bool has_ticks_on_time(const Health& health);
// Empty when the server takes clients and its ticks are on time; else one line with the reason.
std::string why_not_ready(const Health& health);

}  // namespace hairnet::server
