#pragma once

#include <string>

#include "server/room/room_counters.hpp"
#include "server/session/session_counters.hpp"
#include "server/tick/tick_counters.hpp"
#include "server/transport/transport_counters.hpp"

namespace hairnet::server {

// All counters of the server. Any thread.
struct Metrics {
  TransportCounters transport;
  SessionCounters session;
  RoomCounters room;
  TickCounters tick;
  GroomCounters groom;
  LevelCacheCounters level_cache;
};

// "name value", a line each, of those that are not zero.
std::string to_text(const Metrics& metrics);

}  // namespace hairnet::server
