#pragma once

#include <array>
#include <string>

#include "server/agones/agones_counters.hpp"
#include "server/fleet/fleet_counters.hpp"
#include "server/grooms/groom_counters.hpp"
#include "server/objects/object_counters.hpp"
#include "server/room/room_counters.hpp"
#include "server/session/session_counters.hpp"
#include "server/tick/tick_counters.hpp"
#include "server/transport/transport_counters.hpp"

namespace hairnet::server {

// Figures of the process, which read_process() and MemoryWatch set.
struct ProgramGauges : GaugeSet {
  Gauge ready{*this, "ready", "1 while /readyz says so, else 0."};
  Gauge start_time_seconds{*this, "start_time_seconds", "Start of the server, in seconds since 1970."};
  Gauge cpu_seconds{*this, "cpu_seconds", "Processor time of all threads since the start, in seconds."};
  Gauge resident_memory_bytes{*this, "resident_memory_bytes", "Resident memory of the server, in bytes."};
  Gauge memory_max_bytes{*this, "memory_max_bytes", "Bound of the resident memory, in bytes; 0: none."};
  Gauge memory_full{*this, "memory_full", "1 while the server takes nothing that needs more memory, else 0."};
  Gauge open_files{*this, "open_files", "Open descriptors of the server."};
};

struct ProgramCounters : CounterSet {
  Counter log_lines_dropped{*this, "log_lines_dropped",
                            "Lines of the log that were lost, since their reader was too slow or gone."};
  Counter memory_reserve_used{*this, "memory_reserve_used", "Allocations that failed and took the reserve."};
};

// All counters, gauges and histograms of the server. Any thread.
struct Metrics {
  TransportCounters transport;
  SessionCounters session;
  RoomCounters room;
  TickCounters tick;
  GroomCounters groom;
  GroomCacheCounters groom_cache;
  LevelCacheCounters level_cache;
  ObjectCounters objects;
  FleetCounters fleet;
  AgonesCounters agones;
  ProgramGauges program;
  ProgramCounters program_counters;

  // A set that is missing in these lists is counted and never shown.
  [[nodiscard]] std::array<const CounterSet*, 12> counter_sets() const {
    return {&transport,   &transport.quic, &session, &room,  &tick,   &groom,
            &groom_cache, &level_cache,    &objects, &fleet, &agones, &program_counters};
  }
  [[nodiscard]] std::array<const GaugeSet*, 7> gauge_sets() const {
    return {&program, &session.gauges, &tick.gauges, &groom.gauges, &objects.gauges, &fleet.gauges, &agones.gauges};
  }
  [[nodiscard]] std::array<const HistogramSet*, 2> histogram_sets() const {
    return {&session.histograms, &tick.histograms};
  }
};

// The body of /metrics.
std::string prometheus_text(const Metrics& metrics);

// The counters that are not zero: name, `between`, value, `after`, and so on.
std::string to_text(const Metrics& metrics, char between, char after);

}  // namespace hairnet::server
