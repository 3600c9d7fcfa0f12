#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/fleet/etcd_directory.hpp"
#include "server/fleet/fleet_values.hpp"

namespace hairnet::server {
namespace {

constexpr std::int64_t kTellInterval_ns = 1'000'000'000;
constexpr double kToldShareSteps = 32;  // a smaller change of the load is not worth a write to etcd

}  // namespace

void EtcdDirectory::poll_lease(std::int64_t now_ns) {
  const bool may_retry = now_ns >= retry_at_ns_;
  if (is_stopping_) {
    if (may_retry && lease_ != 0 && !is_under_way(Purpose::revoke))
      start(Purpose::revoke, etcd::revoke(lease_), now_ns);
    return;
  }
  if (lease_ == 0) {
    if (may_retry && !is_under_way(Purpose::grant)) start(Purpose::grant, etcd::grant(def_.lease_s), now_ns);
  } else if (now_ns >= keep_alive_at_ns_ && !is_under_way(Purpose::keep_alive) && !is_under_way(Purpose::ask_lease)) {
    if (may_keep_alive(now_ns))
      start(Purpose::keep_alive, etcd::keep_alive(lease_), now_ns);
    else
      start(Purpose::ask_lease, etcd::time_to_live(lease_), now_ns);
  }
}

// Behind a closed fence nobody steps the rooms. While etcd hears this server, and this server does not hear etcd,
// keep-alives would keep them from others: then it only asks for the lease. Once that is answered keep-alives may open
// the fence, but for no longer than half of a lease's time: if none of them does, the lease ends.
bool EtcdDirectory::may_keep_alive(std::int64_t now_ns) {
  const bool is_heard = std::exchange(is_heard_, false);
  return fence_.is_open(now_ns) || (is_heard && now_ns - heard_ns_ < lease_ns_ / 2);
}

// etcd has counted the lease's time from a moment after `from_ns`.
void EtcdDirectory::open_fence(std::int64_t from_ns, std::int64_t lease_ns) {
  fence_.open_until(std::max(fence_.until_ns(), from_ns + lease_ns - lease_margin_ns(lease_ns_)));
}

void EtcdDirectory::take_lease(const Call& call, const etcd::LeaseAnswer& answer, std::int64_t now_ns) {
  if (call.purpose == Purpose::grant) {
    lease_ = answer.lease;
    told_.clear();
    tell_at_ns_ = 0;
    counters_->leases_granted.add();
    spdlog::info("event=lease_granted server={}", id_text(status_.id));
  } else if (call.lease != lease_) {
    return;
  } else if (answer.lease != lease_) {
    return fail(call, EtcdFault::malformed, now_ns);
  } else if (answer.ttl_s == 0) {
    return lose_lease(now_ns);
  } else if (call.purpose == Purpose::ask_lease) {
    silent_.clear();
    is_heard_ = true;
    if (heard_ns_ == 0) heard_ns_ = now_ns;
    keep_alive_at_ns_ = now_ns - heard_ns_ < lease_ns_ / 2 ? now_ns : now_ns + lease_ns_ / 9;
    return;
  }
  silent_.clear();
  heard_ns_ = 0;
  keep_alive_at_ns_ = call.sent_ns + lease_ns_ / 3;
  open_fence(call.sent_ns, std::min(answer.ttl_s * 1'000'000'000, lease_ns_));
  note_fence(now_ns);
}

// An endpoint has not answered a keep-alive. When none has since `silent_from_ns_`, etcd was out of reach for us at
// some moment after that. If it was out of reach for all servers, no lease can have expired then, and its next leader
// gives each lease its full time again. A fence that has closed stays closed: before the silence, etcd may have
// answered others.
//
// The first keep-alive is due after a third of the lease, a round of all endpoints takes a third, and the next begins a
// ninth later: so a round ends before the fence closes.
void EtcdDirectory::note_failed_keep_alive(const Call& call, EtcdFault fault, std::int64_t now_ns) {
  if (fault == EtcdFault::refused || fault == EtcdFault::malformed || fault == EtcdFault::oversize) {
    keep_alive_at_ns_ = now_ns + lease_ns_ / 30;
    return;
  }
  if (silent_.empty()) silent_from_ns_ = call.sent_ns;
  silent_.insert(call.endpoint);
  if (silent_.size() < def_.endpoint_count) return;
  silent_.clear();
  keep_alive_at_ns_ = now_ns + static_cast<std::int64_t>(static_cast<double>(lease_ns_) / 9 * random_.between(0.5, 1));
  if (def_.without_etcd != WithoutEtcd::go_on || call.lease == 0 || call.lease != lease_ || !fence_.is_open(now_ns))
    return;
  counters_->outages_bridged.add();
  open_fence(silent_from_ns_, lease_ns_);
}

void EtcdDirectory::note_fence(std::int64_t now_ns) {
  if (is_stopping_) return;
  const bool is_open = fence_.is_open(now_ns);
  if (is_open == !is_paused_ || (!is_open && lease_ == 0)) return;
  is_paused_ = !is_open;
  if (is_paused_) {
    counters_->leases_paused.add();
    spdlog::warn("event=lease_paused rooms={}", rooms_.size());
  } else {
    spdlog::warn("event=lease_resumed rooms={}", rooms_.size());
  }
  emit({.kind = is_paused_ ? FleetEvent::Kind::lease_paused : FleetEvent::Kind::lease_resumed});
}

// etcd has said that the lease does not exist: so its keys do not, and each room has no owner or another one.
void EtcdDirectory::lose_lease(std::int64_t now_ns) {
  counters_->leases_lost.add();
  spdlog::warn("event=lease_lost rooms={}", rooms_.size());
  fence_.close();
  note_fence(now_ns);
  lease_ = 0;
  silent_.clear();
  for (auto& [name, room] : rooms_) {
    room.is_sent = false;
    if (room.state == Room::State::owned) {
      room.state = Room::State::claiming;
      room.give_up_ns = 0;
      room.is_wanted = true;
      due_.insert(name);
    }
  }
}

void EtcdDirectory::tell(const ServerLoad& load) {
  status_.load = load;
  const double share = std::clamp(load.free_share, 0.0, 1.0);
  status_.load.free_share = std::round(share * kToldShareSteps) / kToldShareSteps;
}

// Who does not know yet what rooms have owners cannot take one.
void EtcdDirectory::poll_status(std::int64_t now_ns) {
  if (lease_ == 0 || !is_listed_ || now_ns < tell_at_ns_ || is_under_way(Purpose::publish)) return;
  std::string value = to_value(status_);
  if (value == told_) return;
  start(Purpose::publish, etcd::put(keys_.of_server(status_.id), value, lease_), now_ns);
  telling_ = std::move(value);
  tell_at_ns_ = now_ns + kTellInterval_ns;
}

}  // namespace hairnet::server
