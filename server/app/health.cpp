#include "server/app/health.hpp"

#include <fmt/format.h>

namespace hairnet::server {

std::string why_not_ready(const Health& health) {
  if (health.draining) return "draining";
  if (!health.accepting) return "not accepting yet";
  if (health.memory_full) return "memory is full";
  if (health.last_tick_ns == 0) return "no tick has run yet";
  const std::int64_t since_ns = health.now_ns - health.last_tick_ns;
  if (since_ns > kTickStallMax_ns)
    return fmt::format("ticks stalled: the last was {:.1f} s ago", static_cast<double>(since_ns) * 1e-9);
  return {};
}

}  // namespace hairnet::server
