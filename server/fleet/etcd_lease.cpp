#include "server/fleet/etcd_lease.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "core/assert.hpp"
#include "server/fleet/fleet_values.hpp"

namespace hairnet::server {

std::int64_t lease_margin_ns(std::int64_t lease_ns) {
  return lease_ns / 10 + 200'000'000;
}

EtcdLease::EtcdLease(const EtcdDirectoryDef& def, EtcdCalls& calls, LeaseFence& fence, FleetCounters& counters,
                     Callbacks callbacks)
    : def_(&def), calls_(&calls), fence_(&fence), counters_(&counters), callbacks_(std::move(callbacks)) {
  HAIRNET_ASSERT(def.lease_s > 0);
}

void EtcdLease::poll(std::int64_t now_ns) {
  // The fence closes without a call when its time has passed, so each poll checks it.
  note_fence(now_ns);
  const bool may_start = calls_->may_start(now_ns);
  if (is_ending_) {
    const auto end = [this](auto, auto) {
      id_ = 0;
      return true;
    };
    if (may_start && id_ != 0 && !calls_->is_under_way(revoke_))
      revoke_ = calls_->start(
          {.request = etcd::revoke(id_), .on_answer = end, .on_lease_gone = [this](auto at_ns) { lose(id_, at_ns); }},
          now_ns);
  } else if (id_ == 0) {
    // now_ns is the time of sending. etcd has counted the lease from a later moment, so the fence is on the safe side
    // however long the answer takes.
    const auto take = [this, now_ns](const auto& answer, auto at_ns) { begin(answer, now_ns, at_ns); };
    if (may_start && !calls_->is_under_way(grant_))
      grant_ = calls_->start(
          {.request = etcd::grant(def_->lease_s), .on_answer = calls_->reading(etcd::parse_grant, take)}, now_ns);
  } else if (now_ns >= keep_alive_at_ns_ && !calls_->is_under_way(keep_alive_)) {
    send_keep_alive(now_ns);
  }
}

void EtcdLease::begin(const etcd::LeaseAnswer& answer, std::int64_t sent_ns, std::int64_t now_ns) {
  id_ = answer.lease;
  counters_->leases_granted.add();
  spdlog::info("event=lease_granted server={}", id_text(def_->server_id));
  // on_granted comes before the fence opens: the new lease has none of the keys of the old one, so the server's entry
  // must be written again.
  callbacks_.on_granted();
  renew(answer, sent_ns, now_ns);
}

void EtcdLease::send_keep_alive(std::int64_t now_ns) {
  const bool is_question = !may_keep_alive(now_ns);
  // A keep-alive goes to every endpoint in turn before it goes to one for the second time: only then does the silence
  // of all of them mean that etcd is out of reach.
  const Sent sent{.lease = id_, .at_ns = now_ns, .endpoint = calls_->next_endpoint(silent_)};
  const auto take_answer = [this, sent, is_question](const auto& answer, auto at_ns) {
    return take(answer, sent, is_question, at_ns);
  };
  keep_alive_ = calls_->start(
      {.request = is_question ? etcd::time_to_live(id_) : etcd::keep_alive(id_),
       .endpoint = sent.endpoint,
       .on_answer = calls_->reading(is_question ? etcd::parse_time_to_live : etcd::parse_keep_alive, take_answer),
       .on_failure = [this, sent](auto error, auto at_ns) { note_failure(sent, error, at_ns); },
       .on_lease_gone = [this, sent](auto at_ns) { lose(sent.lease, at_ns); }},
      now_ns);
}

// Behind a closed fence nobody steps this server's rooms. If etcd receives this server's requests but the answers get
// lost, keep-alives would keep the rooms from other servers. So the server then only asks whether its lease exists.
// After an answer it may send keep-alives again, which open the fence, but only for half of a lease's time. If none of
// them opens the fence, the lease ends.
bool EtcdLease::may_keep_alive(std::int64_t now_ns) {
  const bool is_heard = std::exchange(is_heard_, false);
  return fence_->is_open(now_ns) || (is_heard && now_ns - heard_ns_ < def_->lease_ns() / 2);
}

// Returns false when the answer is about another lease than the one that was asked for.
bool EtcdLease::take(const etcd::LeaseAnswer& answer, const Sent& sent, bool is_question, std::int64_t now_ns) {
  // An answer about an earlier lease comes late, and is no error.
  if (sent.lease != id_) return true;
  if (answer.lease != id_) return false;
  if (answer.ttl_s == 0) {
    lose(id_, now_ns);
  } else if (is_question) {
    silent_.clear();
    is_heard_ = true;
    if (heard_ns_ == 0) heard_ns_ = now_ns;
    // The answer shows that the connection to etcd works in both directions: a keep-alive follows at once. When
    // keep-alives have not opened the fence for half of a lease, only time_to_live requests go on, one each ninth of
    // the lease, and the lease may end.
    keep_alive_at_ns_ = now_ns - heard_ns_ < def_->lease_ns() / 2 ? now_ns : now_ns + def_->lease_ns() / 9;
  } else {
    renew(answer, sent.at_ns, now_ns);
  }
  return true;
}

void EtcdLease::renew(const etcd::LeaseAnswer& answer, std::int64_t sent_ns, std::int64_t now_ns) {
  silent_.clear();
  heard_ns_ = 0;
  keep_alive_at_ns_ = sent_ns + def_->lease_ns() / 3;
  // A time that is not shorter than the configured lease counts as the configured lease: the product must not overflow,
  // whatever etcd answers.
  open_fence(sent_ns,
             answer.ttl_s < def_->lease_ns() / 1'000'000'000 ? answer.ttl_s * 1'000'000'000 : def_->lease_ns());
  note_fence(now_ns);
}

// etcd has counted the lease's time from a moment after `from_ns`. The maximum keeps an answer that a newer one has
// overtaken from moving the fence back.
void EtcdLease::open_fence(std::int64_t from_ns, std::int64_t lease_ns) {
  fence_->open_until(std::max(fence_->until_ns(), from_ns + lease_ns - lease_margin_ns(def_->lease_ns())));
}

// An endpoint has not answered a keep-alive. When no endpoint has answered since `silent_from_ns_`, etcd was out of
// reach for this server at some moment after that time. If etcd was out of reach for all servers, no lease can have
// expired at that moment, and etcd's next leader gives each lease its full time again. So go_on opens the fence until a
// lease's time, less the margin, after silent_from_ns_. A fence that has closed stays closed: etcd may have answered
// other servers before the silence.
//
// A keep-alive is due a third of the lease after the last one. To ask all endpoints takes about another third, and the
// next round begins a ninth later at most. So one round without an answer ends before the fence closes.
void EtcdLease::note_failure(const Sent& sent, EtcdError error, std::int64_t now_ns) {
  // After these errors the endpoint has answered, so etcd is not out of reach; it is asked again after a thirtieth of
  // the lease (0.3 s of 9 s).
  if (error == EtcdError::refused || error == EtcdError::malformed || error == EtcdError::oversize) {
    keep_alive_at_ns_ = now_ns + def_->lease_ns() / 30;
    return;
  }
  if (silent_.empty()) silent_from_ns_ = sent.at_ns;
  silent_.insert(sent.endpoint);
  if (silent_.size() < def_->endpoint_count) return;
  silent_.clear();
  keep_alive_at_ns_ = now_ns + static_cast<std::int64_t>(static_cast<double>(def_->lease_ns()) / 9 * calls_->jitter());
  if (def_->without_etcd != WithoutEtcd::go_on || sent.lease != id_ || !fence_->is_open(now_ns)) return;
  counters_->outages_bridged.add();
  open_fence(silent_from_ns_, def_->lease_ns());
}

void EtcdLease::note_fence(std::int64_t now_ns) {
  if (is_ending_) return;
  const bool is_open = fence_->is_open(now_ns);
  // A fence that is closed because there is no lease pauses nothing.
  if (is_open == !is_paused_ || (!is_open && id_ == 0)) return;
  is_paused_ = !is_open;
  if (is_paused_) counters_->leases_paused.add();
  callbacks_.on_fence(is_open);
}

void EtcdLease::lose(std::int64_t lease, std::int64_t now_ns) {
  // Several calls may report the same loss; the first one counts.
  if (lease == 0 || lease != id_) return;
  counters_->leases_lost.add();
  callbacks_.on_lost();
  fence_->close();
  note_fence(now_ns);
  id_ = 0;
  silent_.clear();
}

void EtcdLease::stop() {
  is_ending_ = true;
  fence_->close();
}

}  // namespace hairnet::server
