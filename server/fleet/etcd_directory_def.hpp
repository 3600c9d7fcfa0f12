#pragma once

#include <cstdint>
#include <string>

#include "server/fleet/server_status.hpp"

namespace hairnet::server {

// What a server's rooms do when the lease runs out because no endpoint of etcd answers.
enum class WithoutEtcd : std::uint8_t {
  // Frames stop until etcd answers: there are never two owners.
  stop,
  // Rooms go on. If etcd is out of reach for all servers, no room gets two owners. If only this server has lost etcd,
  // its rooms may have a second owner until etcd answers this server again.
  go_on,
};

struct EtcdDirectoryDef {
  // Random, new at each start, and never zero: a server that restarts must not take its former keys for its own.
  std::uint64_t server_id = 0;
  // Where clients reach this server; an address without a host is set later.
  ServerAddress address;
  std::string fleet = "default";
  std::size_t endpoint_count = 1;
  // etcd keeps a server's rooms for this long without hearing it.
  std::int64_t lease_s = 9;
  WithoutEtcd without_etcd = WithoutEtcd::stop;
  // Bounds the rooms of this server.
  std::size_t rooms_max = 4096;
  // Seeds the jitter between tries.
  std::uint64_t seed = 0;

  [[nodiscard]] std::int64_t lease_ns() const { return lease_s * 1'000'000'000; }
};

}  // namespace hairnet::server
