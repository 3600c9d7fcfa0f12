#pragma once

#include <cstdint>
#include <functional>
#include <set>

#include "server/fleet/etcd_calls.hpp"
#include "server/fleet/etcd_directory_def.hpp"
#include "server/fleet/fleet_counters.hpp"
#include "server/fleet/lease_fence.hpp"

namespace hairnet::server {

// The fence closes this long before etcd may end the lease: 10 % of the lease and 200 ms. The margin covers clocks of
// different speed, and the time from a check of the fence until the frame leaves; README.md, "Why a room never has two
// owners", has the assumptions.
[[nodiscard]] std::int64_t lease_margin_ns(std::int64_t lease_ns);

// This server's lease at etcd. The class gets a lease, keeps it alive, gives it back at the end, and opens the fence
// for as long as the answers allow. Invariant: the fence never stays open longer than etcd keeps the lease, counted
// from the moment before the answered request was sent. Only WithoutEtcd::go_on opens the fence without an answer. I/O
// thread.
class EtcdLease {
 public:
  // What happens to the lease. All are set.
  struct Callbacks {
    // There is a new lease, without any keys. The fence is still closed.
    std::function<void()> on_granted;
    // etcd has said that the lease does not exist: so its keys do not, and each room has no owner or another one.
    std::function<void()> on_lost;
    // The fence has closed or opened. It is not called after stop().
    std::function<void(bool is_open)> on_fence;
  };
  // All but the callbacks must outlive the lease.
  EtcdLease(const EtcdDirectoryDef& def, EtcdCalls& calls, LeaseFence& fence, FleetCounters& counters,
            Callbacks callbacks);

  // The lease's number at etcd; zero while there is none.
  [[nodiscard]] std::int64_t id() const { return id_; }
  [[nodiscard]] bool is_open(std::int64_t now_ns) const { return fence_->is_open(now_ns); }
  // stop() was called.
  [[nodiscard]] bool is_ending() const { return is_ending_; }
  // Sends the request that is due: for a new lease, a keep-alive, a question for the lease, or its end. Reports a fence
  // whose time has passed.
  void poll(std::int64_t now_ns);
  // etcd has answered that `lease` does not exist. Nothing happens if `lease` is zero or not the present lease.
  void lose(std::int64_t lease, std::int64_t now_ns);
  // The fence closes at once, and polls give the lease back.
  void stop();

 private:
  // A keep-alive that was sent, or a time_to_live request, which asks whether the lease exists and does not prolong it.
  struct Sent {
    std::int64_t lease = 0, at_ns = 0;
    std::size_t endpoint = 0;
  };

  // The request for a lease was answered. `sent_ns` is the time at which it was sent.
  void begin(const etcd::LeaseAnswer& answer, std::int64_t sent_ns, std::int64_t now_ns);
  // Sends a keep-alive, or time_to_live where may_keep_alive() forbids one.
  void send_keep_alive(std::int64_t now_ns);
  // False while the fence is closed, unless etcd has just answered: see the definition.
  [[nodiscard]] bool may_keep_alive(std::int64_t now_ns);
  // Takes an answer. `is_question`: the request was a time_to_live. Returns false when the answer is about another
  // lease.
  [[nodiscard]] bool take(const etcd::LeaseAnswer& answer, const Sent& sent, bool is_question, std::int64_t now_ns);
  // An endpoint has not answered a keep-alive. Plans the next request. With WithoutEtcd::go_on the fence stays open
  // where the definition allows it.
  void note_failure(const Sent& sent, EtcdError error, std::int64_t now_ns);
  // Opens the fence for the time that the answer grants, counted from `sent_ns`, and plans the next keep-alive.
  void renew(const etcd::LeaseAnswer& answer, std::int64_t sent_ns, std::int64_t now_ns);
  // Opens the fence until `from_ns` plus `lease_ns` less the margin, unless it is open for longer already.
  void open_fence(std::int64_t from_ns, std::int64_t lease_ns);
  // Reports by on_fence whether the fence has closed or opened since the last call.
  void note_fence(std::int64_t now_ns);

  const EtcdDirectoryDef* def_;
  EtcdCalls* calls_;
  LeaseFence* fence_;
  FleetCounters* counters_;
  Callbacks callbacks_;
  // The lease's number at etcd; zero: there is no lease.
  std::int64_t id_ = 0;
  // The numbers of the calls in EtcdCalls; zero: there was none yet. `keep_alive_` is also that of a time_to_live.
  std::uint64_t grant_ = 0, keep_alive_ = 0, revoke_ = 0;
  // The next keep-alive or time_to_live is due at this time.
  std::int64_t keep_alive_at_ns_ = 0;
  // A time_to_live has been answered since the last keep-alive was sent.
  bool is_heard_ = false;
  // The first answer to a time_to_live since the fence has closed came at this time; zero: there was none.
  std::int64_t heard_ns_ = 0;
  // The endpoints that have left a keep-alive unanswered since silent_from_ns_, with no answer of any endpoint in
  // between. When all endpoints are in the set, etcd is out of reach for this server.
  std::set<std::size_t> silent_;
  std::int64_t silent_from_ns_ = 0;
  // is_paused_: on_fence has reported that the fence is closed. is_ending_: stop() was called.
  bool is_paused_ = false, is_ending_ = false;
};

}  // namespace hairnet::server
