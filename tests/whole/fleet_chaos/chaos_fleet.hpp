#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/whole/fleet_chaos/machines.hpp"
#include "tests/whole/owner_check.hpp"
#include "tests/whole/process.hpp"

namespace hairnet::whole {

inline constexpr std::size_t kEtcdCount = 3, kServerCount = 4;
inline constexpr std::uint16_t kServerPort = 7420;

// Three etcds and four servers, each on a machine of its own: etcd n is machine n, server n is machine 3 + n.
class ChaosFleet {
 public:
  // Starts all of them. Files go into `folder`. The error is one line.
  static Result<std::unique_ptr<ChaosFleet>> start(std::string folder, std::int64_t lease_s,
                                                   const std::string& without_etcd, OwnerCheck& owners);
  ~ChaosFleet();
  ChaosFleet(const ChaosFleet&) = delete;
  ChaosFleet& operator=(const ChaosFleet&) = delete;

  void start_server(std::size_t server);
  void start_etcd(std::size_t etcd);
  // It applies to servers that are started after this call.
  void set_without_etcd(const std::string& value) { without_etcd_ = value; }
  [[nodiscard]] Process& server(std::size_t n) { return *servers_[n].process; }
  [[nodiscard]] Process& etcd(std::size_t n) { return *etcds_[n]; }
  // Returns the number of the server's present process. Each start gives another number, which is never used again.
  [[nodiscard]] std::size_t process_of(std::size_t server) const { return servers_[server].life; }
  [[nodiscard]] std::size_t server_of(std::size_t process) const { return process % kServerCount; }
  [[nodiscard]] std::string address(std::size_t server) const { return machines_->address(kEtcdCount + server); }
  // Returns the index of the server with this address; kServerCount when it is no server's.
  [[nodiscard]] std::size_t server_at(const std::string& address) const;

  // From this call on, until it is healed, a server's packets to and from all etcds get lost, or an etcd's packets to
  // and from the other etcds. They return one line when they fail, and an empty text otherwise.
  std::string cut_server(std::size_t server, CutDirection direction);
  std::string cut_etcd(std::size_t etcd);
  std::string heal_server(std::size_t server) { return machines_->heal(kEtcdCount + server); }
  std::string heal_etcd(std::size_t etcd) { return machines_->heal(etcd); }

  // Reads what the servers have logged since the last call.
  void read_logs();
  // Returns the time on CLOCK_MONOTONIC since which a majority of the etcds has answered without a break; 0 when no
  // majority answers now.
  [[nodiscard]] std::int64_t etcd_healthy_since_ns() const { return healthy_since_ns_; }
  // Sends SIGTERM to all servers and waits for their ends. Returns one line for each server that did not end well.
  std::vector<std::string> stop();
  // Returns how often each event occurred in the servers' logs.
  [[nodiscard]] const std::map<std::string, std::uint64_t>& events() const { return events_; }

 private:
  struct Server {
    std::unique_ptr<Process> process;
    // The number of the present process (process_of).
    std::size_t life = 0;
    // The file of the present process's log, and how much of it was read.
    std::string log;
    std::size_t read_bytes = 0;
  };
  ChaosFleet(std::string folder, std::int64_t lease_s, std::string without_etcd, OwnerCheck& owners)
      : folder_(std::move(folder)), lease_s_(lease_s), without_etcd_(std::move(without_etcd)), owners_(&owners) {}
  void read_log(Server& server);
  void take_line(const Server& server, const std::string& line);
  void watch_health(const std::stop_token& stop);

  std::string folder_;
  std::int64_t lease_s_;
  std::string without_etcd_;
  OwnerCheck* owners_;
  std::unique_ptr<Machines> machines_;
  std::vector<std::unique_ptr<Process>> etcds_;
  std::vector<Server> servers_;
  std::vector<int> etcd_starts_;
  std::map<std::string, std::uint64_t> events_;
  std::atomic<std::int64_t> healthy_since_ns_{0};
  // This member is the last one, because its thread uses the members above.
  std::jthread health_;
};

}  // namespace hairnet::whole
