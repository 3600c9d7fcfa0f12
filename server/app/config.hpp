#pragma once

#include <cstdint>
#include <string>

#include "core/solver/wind.hpp"
#include "server/fleet/etcd_directory.hpp"
#include "server/grooms/groom_store.hpp"
#include "server/session/session_limits.hpp"
#include "server/transport/etcd_endpoint.hpp"
#include "server/transport/s3_endpoint.hpp"
#include "server/transport/transport_options.hpp"

namespace hairnet::server {

// Whether Agones is told about this server.
enum class UseAgones : std::uint8_t {
  off,
  on,
  automatic,  // where Agones has set the port of its sidecar
};

// Several servers that share rooms, through etcd.
struct FleetConfig {
  EtcdOptions etcd;  // without endpoints the server is on its own
  std::string name = "default";
  std::string address;  // host or host:port that clients are told; kAddressOfAgones: as Agones says
  std::string page;     // URL of this server's page
  std::int64_t lease_s = 9;
  WithoutEtcd without_etcd = WithoutEtcd::stop;
  std::vector<std::string> big_rooms;  // each should have a server of its own
  double own_server_share = 0.5;       // of a server's time, from which on a room should have one, too
  bool balance = true;                 // a server without free time gives up rooms
  UseAgones agones = UseAgones::automatic;

  static constexpr const char* kAddressOfAgones = "agones";
};

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
  S3Options object_store;  // behind both caches, shared by servers; without a URL there is none
  Wind wind;               // of every room, until one of its clients sets another
  std::string record;      // recording file; empty: none
  std::string log_level = "warn";
  double counters_interval_s = 10;                       // at log level debug
  std::size_t command_weight_max = 262'144;              // commands and poses on their way to the tick
  std::string token_key_file;                            // clients need tokens signed by it; empty: none
  std::string token_revoked_file;                        // names of revoked tokens, one a line; empty: none
  std::size_t state_bytes_max = std::size_t{256} << 20;  // of all hair states that wait for their levels
  std::int64_t room_grace_ns = 10'000'000'000;           // how long an empty room exists, with its mutes and lock
  double drain_s = 2;                                    // at shutdown, for clients to read what waits
  SessionLimits sessions;
  GroomStoreLimits grooms;
  FleetConfig fleet;
  TransportOptions transport;  // without its address and port: those are above
};

struct ParsedConfig {
  Config config;
  bool check_only = false;
  int exit_code = -1;  // >= 0: exit with this code; help or an error has been printed
};
ParsedConfig parse_config(int argc, const char* const* argv);

// Where clients reach the server, whose public port is `port`. Without a host where only Agones knows it.
ServerAddress fleet_address(const FleetConfig& fleet, std::uint16_t port);

// Returns an empty string when the values agree with each other; else one line.
std::string validate(const Config& config);
// Every setting as a configuration file has it.
std::string to_text(const Config& config);
// One line for the log.
std::string summary(const Config& config);

}  // namespace hairnet::server
