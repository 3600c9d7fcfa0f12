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

// The texts that move with this server's rooms to their next owners (Directory::keep), one for each room, in etcd under
// the prefix `kept`, and the lease of these keys. If the texts were under the server's own lease, they would vanish
// when the server dies, just when the next owners need them. So they have a lease of their own, which outlives this
// server. I/O thread.
class EtcdKept {
 public:
  // `keys`, `calls` and `counters` must outlive this object.
  EtcdKept(const FleetKeys& keys, EtcdCalls& calls, FleetCounters& counters);

  // The room gets a text, which is empty at first. The calls below that name a room need it to have been added;
  // forget() does not.
  void add(const std::string& room) { texts_.insert_or_assign(room, Text{}); }
  void forget(const std::string& room);
  void clear();
  // Stores this text of the room in place of the last one; empty: the room has none.
  void put(const std::string& room, std::string text);
  // A claim of the room has succeeded. `found` is the text that its transaction has read in etcd; null: etcd has none.
  // `was_ours`: this server owned the room until its lease was lost. Returns the room's text.
  const std::string& take(const std::string& room, const etcd::KeyValue* found, bool was_ours);
  // Whether the room may be released without losing its text: the text is in etcd, or there is a lease under which the
  // release can put it there.
  [[nodiscard]] bool may_release(const std::string& room) const;
  // The change of the room's text that its release makes in the same transaction.
  [[nodiscard]] etcd::Beside beside_release(const std::string& room) const;
  // Writes texts. `claim_of` returns the number of a room's claim; zero: this server does not own the room.
  void poll(const std::function<std::int64_t(const std::string& room)>& claim_of, std::int64_t now_ns);
  // The texts have vanished from etcd with their lease: all of them are put again, under a new lease.
  void lose_lease();

 private:
  struct Text {
    std::string text = {};
    // etcd may have a text of the room, so an empty `text` means that it must be removed there.
    bool is_kept = false;
    // The call that writes `text`; zero: there is none.
    std::uint64_t call = 0;
  };

  // The lease of the texts was granted or renewed, by a request that was sent at `sent_ns`.
  void take_lease(const etcd::LeaseAnswer& answer, std::int64_t sent_ns);
  // The call that writes the room's text has ended. If it is not done, the text is written again.
  void end_put(const std::string& room, bool is_done);

  const FleetKeys* keys_;
  EtcdCalls* calls_;
  FleetCounters* counters_;
  std::map<std::string, Text> texts_;
  // The rooms whose present text was not sent to etcd yet, or not written there.
  std::set<std::string> due_;
  // The lease of the texts; zero: there is none.
  std::int64_t lease_ = 0;
  // The numbers of the calls in EtcdCalls; zero: there was none yet.
  std::uint64_t grant_ = 0, renewal_ = 0;
  // The lease is renewed at this time next.
  std::int64_t renewal_ns_ = 0;
};

}  // namespace hairnet::server
