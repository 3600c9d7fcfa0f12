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

// Whether this server reports its state to Agones, on Kubernetes.
enum class UseAgones : std::uint8_t {
  off,
  on,
  // On where Agones has set the port of its sidecar.
  automatic,
};

// Several servers that share rooms, through etcd.
struct FleetConfig {
  // Without endpoints the server is on its own.
  EtcdOptions etcd;
  std::string name = "default";
  // Other servers send clients to this server at this host or host:port. kAddressOfAgones: the address comes from
  // Agones.
  std::string address;
  // The page of the fleet links to this URL as the server's own page.
  std::string page;
  std::int64_t lease_s = 9;
  WithoutEtcd without_etcd = WithoutEtcd::stop;
  // Each of these should have a server of its own.
  std::vector<std::string> big_rooms;
  // A room that wants more than this share of a server's time should have one of its own, too.
  double own_server_share = 0.5;
  // A server without free time gives up rooms.
  bool balance = true;
  UseAgones agones = UseAgones::automatic;

  static constexpr const char* kAddressOfAgones = "agones";
};

// Everything that can be set, and every limit. settings.cpp has each one's flag, key and range.
struct Config {
  std::string bind = "127.0.0.1";
  // Zero lets the system pick one.
  std::uint16_t port = 7420;
  // Serves /healthz, /readyz and /metrics over plain HTTP; zero: they are on `port`.
  std::uint16_t service_port = 0;
  std::string service_bind = "127.0.0.1";
  // The port in use is written to this file; empty: to none.
  std::string port_file;
  std::uint32_t tick_rate_hz = 30;
  // A tick samples poses this long before its time. 25 ms are the interval of a client with 60 to 72 Hz, 14 to 17 ms,
  // and the jitter of its network.
  double pose_delay_ms = 25;
  // Zero makes as many as keep each step within kStepMax_s.
  int substeps = 0;
  // Zero leaves each level its own number.
  int iterations = 0;
  // More overdue ticks than this are skipped.
  std::uint32_t ticks_behind_max = 3;
  // A tick's work may take this share of it: levels are lowered to stay within it.
  double tick_budget = 0.7;
  // The tick runs on this many threads; zero: one for each hardware thread, minus one if there are three or more.
  std::uint32_t workers = 0;
  // Bounds the memory of the server's process; zero: half of the machine's.
  std::uint64_t memory_max_mib = 0;
  // A groom is built on this many threads; zero: one for each hardware thread, at most 4.
  std::uint32_t build_threads = 0;
  // Uploaded grooms are kept in this folder; empty: there is no cache.
  std::string groom_cache;
  std::uint64_t groom_cache_mib = 4096;
  // Built levels are kept in this folder; empty: there is no cache.
  std::string level_cache;
  std::uint64_t level_cache_mib = 1024;
  // The store stands behind both caches, and servers share it; without a URL there is none.
  S3Options object_store;
  // Every room has this wind until one of its clients sets another.
  Wind wind;
  // The recording is written to this file; empty: there is none.
  std::string record;
  std::string log_level = "warn";
  // Counters are logged this often, at log level debug.
  double counters_interval_s = 10;
  // Bounds the commands and poses on their way to the tick.
  std::size_t command_weight_max = 262'144;
  // Clients need tokens signed by this file's key; empty: they need none.
  std::string token_key_file;
  // Names revoked tokens, one a line; empty: there is no such file.
  std::string token_revoked_file;
  // Bounds all hair states that wait for their levels.
  std::size_t state_bytes_max = std::size_t{256} << 20;
  // An empty room exists this long, with its mutes, lock and props.
  std::int64_t room_grace_ns = 10'000'000'000;
  // At shutdown clients have this long to read what waits.
  double drain_s = 2;
  SessionLimits sessions;
  GroomStoreLimits grooms;
  FleetConfig fleet;
  // Its addresses and its port come from `bind` and `port` above.
  TransportOptions transport;
};

// The configuration by the command line and the file, or the exit code with which the program should end.
struct ParsedConfig {
  Config config;
  bool check_only = false;
  // The program ends with this code, if it is not negative: help or an error has been printed.
  int exit_code = -1;
};
// Reads flags and the file that --config names; a flag wins over the file. Computes what was not set, and validates the
// whole. Prints help and errors itself, before any thread exists.
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
