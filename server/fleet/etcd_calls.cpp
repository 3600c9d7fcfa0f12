#include "server/fleet/etcd_calls.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <vector>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

constexpr std::int64_t kMs = 1'000'000, kSecond_ns = 1'000'000'000;
constexpr std::int64_t kRequestTimeoutMin_ns = 200 * kMs, kRequestTimeoutMax_ns = 2 * kSecond_ns;
constexpr std::int64_t kBackoffMin_ns = 50 * kMs, kBackoffMax_ns = kSecond_ns;

Counter& counter_of(FleetCounters& counters, EtcdFault fault) {
  switch (fault) {
    case EtcdFault::unreachable:
      return counters.requests_failed_unreachable;
    case EtcdFault::timeout:
      return counters.requests_failed_timeout;
    case EtcdFault::broken:
      return counters.requests_failed_broken;
    case EtcdFault::refused:
      return counters.requests_failed_refused;
    case EtcdFault::oversize:
      return counters.requests_failed_oversize;
    case EtcdFault::malformed:
      break;
  }
  return counters.requests_failed_malformed;
}

}  // namespace

EtcdCalls::EtcdCalls(const EtcdDirectoryDef& def, EtcdTransport& transport, FleetCounters& counters)
    : def_(&def), transport_(&transport), counters_(&counters), random_(def.seed) {
  HAIRNET_ASSERT(def.endpoint_count > 0);
  // All endpoints get their turn in a third of the lease.
  timeout_ns_ = std::clamp(def.lease_ns() / (3 * static_cast<std::int64_t>(def.endpoint_count)), kRequestTimeoutMin_ns,
                           kRequestTimeoutMax_ns);
}

std::uint64_t EtcdCalls::start(EtcdCallDef def, std::int64_t now_ns) {
  const std::uint64_t id = ++last_call_;
  const std::size_t endpoint = def.endpoint.value_or(endpoint_);
  const std::int64_t timeout_ns = def.timeout_ns != 0 ? def.timeout_ns : timeout_ns_;
  counters_->requests.add();
  transport_->send({.id = id,
                    .endpoint = endpoint,
                    .path = std::move(def.request.path),
                    .body = std::move(def.request.body),
                    .is_stream = static_cast<bool>(def.on_change)});
  calls_.emplace(
      id,
      Call{.def = std::move(def), .endpoint = endpoint, .generation = generation_, .deadline_ns = now_ns + timeout_ns});
  return id;
}

void EtcdCalls::stop(std::uint64_t id) {
  if (calls_.erase(id) != 0) transport_->cancel(id);
}

void EtcdCalls::stop_all() {
  while (!calls_.empty()) stop(calls_.begin()->first);
}

void EtcdCalls::end_overdue(std::int64_t now_ns) {
  std::vector<std::uint64_t> overdue;
  for (const auto& [id, call] : calls_)
    if (!call.def.on_change && now_ns >= call.deadline_ns) overdue.push_back(id);
  for (const std::uint64_t id : overdue) {
    if (!is_under_way(id)) continue;
    transport_->cancel(id);
    on_fault(id, EtcdFault::timeout, now_ns);
  }
}

std::size_t EtcdCalls::next_endpoint(const std::set<std::size_t>& silent) const {
  std::size_t next = endpoint_;
  while (silent.contains(next)) next = (next + 1) % def_->endpoint_count;
  return next;
}

void EtcdCalls::on_answer(std::uint64_t id, int status, std::string_view body, std::int64_t now_ns) {
  const auto found = calls_.find(id);
  if (found == calls_.end()) return;
  const Call call = std::move(found->second);
  calls_.erase(found);
  if (status == 200 && call.def.on_answer) {
    if (!call.def.on_answer(body, now_ns)) fail(call, EtcdFault::malformed, now_ns);
    return;
  }
  if (call.def.on_lease_gone && etcd::is_lease_gone(status, body)) {
    failures_ = 0;
    return call.def.on_lease_gone(now_ns);
  }
  spdlog::debug("event=etcd_refused status={} endpoint={}", status, call.endpoint);
  // 503 and 504: this member of etcd has lost the others.
  const bool is_silent = status == 503 || status == 504;
  fail(call, is_silent ? EtcdFault::unreachable : EtcdFault::refused, now_ns);
}

void EtcdCalls::on_line(std::uint64_t id, std::string_view line, std::int64_t now_ns) {
  const auto found = calls_.find(id);
  if (found == calls_.end() || !found->second.def.on_change || line.empty()) return;
  const Call call = found->second;  // a copy, as its sender may stop it
  const auto answer = etcd::parse_watch(line);
  if (answer) {
    failures_ = 0;
    if (call.def.on_change(*answer, now_ns)) return;
  }
  stop(id);
  fail(call, answer ? EtcdFault::refused : EtcdFault::malformed, now_ns);
}

void EtcdCalls::on_fault(std::uint64_t id, EtcdFault fault, std::int64_t now_ns) {
  const auto found = calls_.find(id);
  if (found == calls_.end()) return;
  const Call call = std::move(found->second);
  calls_.erase(found);
  fail(call, fault, now_ns);
}

void EtcdCalls::warn_of(const std::string& error) {
  spdlog::warn("event=etcd_malformed detail=\"{}\"", error);
}

void EtcdCalls::fail(const Call& call, EtcdFault fault, std::int64_t now_ns) {
  counter_of(*counters_, fault).add();
  if (call.generation == generation_) turn_to_next_endpoint(call.endpoint, fault, now_ns);
  if (call.def.on_failure) call.def.on_failure(fault, now_ns);
}

// It gets its turn at once; when all have had one, there is a pause, each time longer. An answer that is too long is an
// answer, and as long elsewhere.
void EtcdCalls::turn_to_next_endpoint(std::size_t failed, EtcdFault fault, std::int64_t now_ns) {
  ++generation_;
  endpoint_ = (endpoint_ + 1) % def_->endpoint_count;
  if (fault == EtcdFault::oversize) {
    retry_at_ns_ = now_ns + kBackoffMin_ns;
    return;
  }
  ++failures_;
  if (failures_ == def_->endpoint_count) spdlog::warn("event=etcd_unreachable");
  if (failures_ % def_->endpoint_count == 0) {
    const std::size_t rounds = failures_ / def_->endpoint_count;
    const std::int64_t most_ns = std::min(kBackoffMax_ns, def_->lease_ns() / 9);
    const std::int64_t wait_ns = std::min(most_ns, kBackoffMin_ns << std::min<std::size_t>(rounds - 1, 6));
    retry_at_ns_ = now_ns + static_cast<std::int64_t>(static_cast<double>(wait_ns) * jitter());
  }
  const auto watch = std::ranges::find_if(
      calls_, [failed](const auto& entry) { return entry.second.def.on_change && entry.second.endpoint == failed; });
  if (watch != calls_.end()) stop(watch->first);
}

}  // namespace hairnet::server
