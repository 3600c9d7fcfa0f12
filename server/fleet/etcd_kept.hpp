#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>

#include "server/fleet/etcd_calls.hpp"
#include "server/fleet/fleet_counters.hpp"
#include "server/fleet/fleet_view.hpp"

namespace hairnet::server {

// What moves with this server's rooms to their next owners: a text each, in etcd under `kept`, and the lease of these
// keys. The server's own lease would take the texts away just when the next owner of a dead server's room needs them,
// so they have another one, which outlives this server. I/O thread.
class EtcdKept {
 public:
  // All three must outlive it.
  EtcdKept(const FleetKeys& keys, EtcdCalls& calls, FleetCounters& counters);

  // The room gets a text, which is empty at first. Each call below is about a room that was added.
  void add(const std::string& room) { texts_.insert_or_assign(room, Text{}); }
  void forget(const std::string& room);
  void clear();
  // Keeps this text of the room instead of the last one; empty: none.
  void put(const std::string& room, std::string text);
  // A claim of the room has succeeded, and has found this in etcd; null: nothing. `was_ours`: the room was this
  // server's before. Returns the room's text.
  const std::string& take(const std::string& room, const etcd::KeyValue* found, bool was_ours);
  // The room's last text is in etcd, or a release can put it there.
  [[nodiscard]] bool may_release(const std::string& room) const;
  // What a release puts or removes beside the room's key.
  [[nodiscard]] etcd::Beside beside_release(const std::string& room) const;
  // Writes texts. `claim_of` returns the number of a room's claim; zero: this server does not own the room.
  void poll(const std::function<std::int64_t(const std::string& room)>& claim_of, std::int64_t now_ns);
  // What was kept has vanished with its lease: all of it is put again, under another one.
  void lose_lease();

 private:
  struct Text {
    std::string text = {};
    // etcd may have a text of the room.
    bool is_kept = false;
    // Writes `text`; zero: no call does.
    std::uint64_t call = 0;
  };

  void take_lease(const etcd::LeaseAnswer& answer, std::int64_t sent_ns);
  void end_put(const std::string& room, bool is_done);

  const FleetKeys* keys_;
  EtcdCalls* calls_;
  FleetCounters* counters_;
  std::map<std::string, Text> texts_;
  // The texts of these rooms are not in etcd.
  std::set<std::string> due_;
  // The lease of the texts; zero: there is none.
  std::int64_t lease_ = 0;
  // Calls.
  std::uint64_t grant_ = 0, renewal_ = 0;
  std::int64_t renewal_ns_ = 0;
};

}  // namespace hairnet::server
