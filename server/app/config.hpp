#pragma once

#include <cstdint>
#include <string>

#include "core/solver/wind.hpp"
#include "server/grooms/groom_store.hpp"
#include "server/session/session_limits.hpp"
#include "server/transport/transport_options.hpp"

namespace hairnet::server {

// Everything that can be set, and every limit. settings.cpp has each one's flag, key and range.
struct Config {
  std::string bind = "127.0.0.1";
  std::uint16_t port = 7420;  // 0: the system picks one
  // Port of /healthz, /readyz and /metrics, plain HTTP; 0: they are on `port`.
  std::uint16_t service_port = 0;
  std::string service_bind = "127.0.0.1";
  std::string port_file;  // file to which the port in use is written; empty: none
  std::uint32_t tick_rate_hz = 30;
  // how far before its time a tick samples poses: an interval of a 60-72 Hz client and its jitter
  double pose_delay_ms = 25;
  int substeps = 0;                    // 0: enough that no step exceeds kStepMax_s
  int iterations = 0;                  // 0: each level's own
  std::uint32_t ticks_behind_max = 3;  // more overdue ticks than this are skipped
  double tick_budget = 0.7;            // share of a tick that its work may take: levels are lowered to stay within it
  // threads of the tick; 0: one for each hardware thread, minus one if there are three or more
  std::uint32_t workers = 0;
  std::uint64_t memory_max_mib = 0;  // of the server's process; 0: half of the machine's
  std::uint32_t build_threads = 0;   // threads of a groom's build; 0: one for each hardware thread, at most 4
  std::string groom_cache;           // folder of uploaded grooms; empty: no cache
  std::uint64_t groom_cache_mib = 4096;
  std::string level_cache;  // folder of built levels; empty: no cache
  std::uint64_t level_cache_mib = 1024;
  Wind wind;           // of every room, until one of its clients sets another
  std::string record;  // recording file; empty: none
  std::string log_level = "warn";
  double counters_interval_s = 10;                       // at log level debug
  std::size_t command_weight_max = 262'144;              // commands and poses on their way to the tick
  std::string token_key_file;                            // clients need tokens signed by it; empty: none
  std::string token_revoked_file;                        // names of revoked tokens, one a line; empty: none
  std::size_t state_bytes_max = std::size_t{256} << 20;  // of all hair states that wait for their levels
  std::int64_t room_grace_ns = 10'000'000'000;           // how long an empty room exists, with its wind, mutes and lock
  double drain_s = 2;                                    // at shutdown, for clients to read what waits
  SessionLimits sessions;
  GroomStoreLimits grooms;
  TransportOptions transport;  // without its address and port: those are above
};

struct ParsedConfig {
  Config config;
  bool check_only = false;
  int exit_code = -1;  // >= 0: exit with this code; help or an error has been printed
};
ParsedConfig parse_config(int argc, const char* const* argv);

// Returns an empty string when the values agree with each other; else one line.
std::string validate(const Config& config);
// Every setting as a configuration file has it.
std::string to_text(const Config& config);
// One line for the log.
std::string summary(const Config& config);

}  // namespace hairnet::server
