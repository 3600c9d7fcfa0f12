#include "server/app/health.hpp"

#include <fmt/format.h>

namespace hairnet::server {

bool has_ticks_on_time(const Health& health) {
  return health.last_tick_ns != 0 && health.now_ns - health.last_tick_ns <= kTickStallMax_ns;
}

std::string why_not_ready(const Health& health) {
  // The first reason is the one that an operator can act on; a server that drains is expected to fail the others, too.
  if (health.draining) return "draining";
  if (!health.accepting) return "not accepting yet";
  if (health.memory_full) return "memory is full";
  if (!health.in_fleet) return "no valid lease in etcd: rooms stand still, and none can be claimed";
  if (health.last_tick_ns == 0) return "no tick has run yet";
  if (!has_ticks_on_time(health))
    return fmt::format("ticks stalled: the last was {:.1f} s ago",
                       static_cast<double>(health.now_ns - health.last_tick_ns) * 1e-9);
  return {};
}

}  // namespace hairnet::server
