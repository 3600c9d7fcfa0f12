#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/fleet/etcd_calls.hpp"
#include "server/fleet/etcd_directory_def.hpp"
#include "server/fleet/etcd_lease.hpp"
#include "server/fleet/server_status.hpp"

namespace hairnet::server {

// This server's own entry in etcd, under the prefix `servers`: its address, its load, and whether it drains. The class
// has the present values, and writes them to etcd under the server's lease. I/O thread.
class EtcdEntry {
 public:
  // `calls` and `lease` must outlive the entry.
  EtcdEntry(const EtcdDirectoryDef& def, EtcdCalls& calls, EtcdLease& lease);

  [[nodiscard]] const ServerStatus& status() const { return status_; }
  void set_address(const ServerAddress& address) { status_.address = address; }
  // Sets the load, with the free share rounded, so that small changes cause no write.
  void tell(const ServerLoad& load);
  // The next poll tells that the server drains.
  void drain();
  // Sets the grooms of the entry, kPassedGroomsMax at most.
  void pass_on(std::vector<ContentHash> grooms);
  // Writes the entry if it has changed: a load at most once a second.
  void poll(std::int64_t now_ns);
  // The lease is new: the next poll writes the entry.
  void on_lease_granted();
  // The watch has brought this entry of a server, or its deletion. If it is this server's entry and has not this
  // server's lease, another program has written or deleted it, and the next poll writes it again.
  void check(const etcd::KeyValue& entry);
  // A list has shown that etcd does not have the entry: the next poll writes it.
  void write_again() { written_.clear(); }

 private:
  EtcdCalls* calls_;
  EtcdLease* lease_;
  std::string key_;
  ServerStatus status_;
  // The value of our key, as etcd has it under this lease; empty: not known.
  std::string written_;
  // The call that writes the entry.
  std::uint64_t call_ = 0;
  // The entry is not written before this time.
  std::int64_t tell_at_ns_ = 0;
};

}  // namespace hairnet::server
