#pragma once

#include <cstdint>
#include <functional>
#include <set>

#include "server/fleet/etcd_calls.hpp"
#include "server/fleet/etcd_directory_def.hpp"
#include "server/fleet/fleet_counters.hpp"
#include "server/fleet/lease_fence.hpp"

namespace hairnet::server {

// The part of a lease's time that is not used: 10 % of it and 200 ms. It covers clocks of different speed, and the time
// between a check of the fence and the frame that leaves.
[[nodiscard]] std::int64_t lease_margin_ns(std::int64_t lease_ns);

// This server's lease at etcd. It gets a lease, keeps it alive, gives it back at the end, and moves the fence with the
// answers. Invariant: the fence never stays open longer than etcd keeps the lease, counted from the moment before the
// answered request was sent. Only `go_on` extends it without an answer. I/O thread.
class EtcdLease {
 public:
  // What happens to the lease. All are set.
  struct Callbacks {
    std::function<void()> on_granted;
    // etcd has said that the lease does not exist: so its keys do not, and each room has no owner or another one.
    std::function<void()> on_lost;
    // The fence has closed or opened, not at the end of the server.
    std::function<void(bool is_open)> on_fence;
  };
  // The first four must outlive the lease.
  EtcdLease(const EtcdDirectoryDef& def, EtcdCalls& calls, LeaseFence& fence, FleetCounters& counters,
            Callbacks callbacks);

  // The lease's number at etcd; zero while there is none.
  [[nodiscard]] std::int64_t id() const { return id_; }
  [[nodiscard]] bool is_open(std::int64_t now_ns) const { return fence_->is_open(now_ns); }
  // stop() was called.
  [[nodiscard]] bool is_ending() const { return is_ending_; }
  void poll(std::int64_t now_ns);
  // etcd has said that `lease` does not exist. It may be an earlier one, or zero: then nothing happens.
  void lose(std::int64_t lease, std::int64_t now_ns);
  // The fence closes at once, and polls give the lease back.
  void stop();

 private:
  // A keep-alive, or a question whether the lease exists.
  struct Sent {
    std::int64_t lease = 0, at_ns = 0;
    std::size_t endpoint = 0;
  };

  void begin(const etcd::LeaseAnswer& answer, std::int64_t sent_ns, std::int64_t now_ns);
  void send_keep_alive(std::int64_t now_ns);
  [[nodiscard]] bool may_keep_alive(std::int64_t now_ns);
  [[nodiscard]] bool take(const etcd::LeaseAnswer& answer, const Sent& sent, bool is_question, std::int64_t now_ns);
  void note_failure(const Sent& sent, EtcdError error, std::int64_t now_ns);
  void renew(const etcd::LeaseAnswer& answer, std::int64_t sent_ns, std::int64_t now_ns);
  void open_fence(std::int64_t from_ns, std::int64_t lease_ns);
  void note_fence(std::int64_t now_ns);

  const EtcdDirectoryDef* def_;
  EtcdCalls* calls_;
  LeaseFence* fence_;
  FleetCounters* counters_;
  Callbacks callbacks_;
  std::int64_t id_ = 0;
  // Calls.
  std::uint64_t grant_ = 0, keep_alive_ = 0, revoke_ = 0;
  // The next keep-alive, or question, is due at this time.
  std::int64_t keep_alive_at_ns_ = 0;
  // time_to_live has an answer, since the last keep-alive.
  bool is_heard_ = false;
  // time_to_live had an answer first at this time since the fence has closed; zero: not yet.
  std::int64_t heard_ns_ = 0;
  // These endpoints have not answered a keep-alive since silent_from_ns_.
  std::set<std::size_t> silent_;
  std::int64_t silent_from_ns_ = 0;
  bool is_paused_ = false, is_ending_ = false;
};

}  // namespace hairnet::server
