#pragma once

#include <cstdint>
#include <string>

namespace hairnet::server {

// The state that /readyz reports. All times on the server's monotonic clock.
struct Health {
  // The port is open.
  bool accepting = false;
  // A signal has asked the server to end.
  bool draining = false;
  // New clients are refused.
  bool memory_full = false;
  // The server may have rooms: its lease is valid, or it is on its own.
  bool in_fleet = true;
  // The newest tick ended at this time; zero: none has run yet.
  std::int64_t last_tick_ns = 0;
  std::int64_t now_ns = 0;
};

// Ticks count as stalled after this long without one: thirty periods at 30 Hz.
inline constexpr std::int64_t kTickStallMax_ns = 1'000'000'000;

// Whether a tick has ended within kTickStallMax_ns. Agones replaces a server where none has.
[[nodiscard]] bool has_ticks_on_time(const Health& health);
// Empty when the server takes clients and its ticks are on time; else one line with the reason.
std::string why_not_ready(const Health& health);

}  // namespace hairnet::server
