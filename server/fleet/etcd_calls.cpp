#include "server/fleet/etcd_calls.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <vector>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

constexpr std::int64_t kMs = 1'000'000, kSecond_ns = 1'000'000'000;
// Bounds of timeout_ns_. A shorter time would let calls fail at an etcd that is only busy; a longer one would leave no
// time for the other endpoints before the lease ends.
constexpr std::int64_t kRequestTimeoutMin_ns = 200 * kMs, kRequestTimeoutMax_ns = 2 * kSecond_ns;
// The first pause after all endpoints have failed, and the longest one; each pause is twice as long as the one before.
constexpr std::int64_t kBackoffMin_ns = 50 * kMs, kBackoffMax_ns = kSecond_ns;

Counter& counter_of(FleetCounters& counters, EtcdError error) {
  switch (error) {
    case EtcdError::unreachable:
      return counters.requests_failed_unreachable;
    case EtcdError::timeout:
      return counters.requests_failed_timeout;
    case EtcdError::broken:
      return counters.requests_failed_broken;
    case EtcdError::refused:
      return counters.requests_failed_refused;
    case EtcdError::oversize:
      return counters.requests_failed_oversize;
    case EtcdError::malformed:
      break;
  }
  return counters.requests_failed_malformed;
}

}  // namespace

EtcdCalls::EtcdCalls(const EtcdDirectoryDef& def, EtcdTransport& transport, FleetCounters& counters)
    : def_(&def), transport_(&transport), counters_(&counters), random_(def.seed) {
  HAIRNET_ASSERT(def.endpoint_count > 0);
  // All endpoints get their turn in a third of the lease, so that a dead one does not cost the lease.
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
  // The call is entered after send(): the transport calls its sink later, never inside send().
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
  // A failure may start and stop other calls, so the overdue ones are gathered before.
  for (const std::uint64_t id : overdue) {
    if (!is_under_way(id)) continue;
    transport_->cancel(id);
    on_error(id, EtcdError::timeout, now_ns);
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
  // The call leaves the map before its sender hears of it: the sender may start the next one at once.
  const Call call = std::move(found->second);
  calls_.erase(found);
  if (status == 200 && call.def.on_answer) {
    if (!call.def.on_answer(body, now_ns)) fail(call, EtcdError::malformed, now_ns);
    return;
  }
  // An answer which says that the lease does not exist is an answer, not a failure of the endpoint.
  if (call.def.on_lease_gone && etcd::is_lease_gone(status, body)) {
    failures_ = 0;
    return call.def.on_lease_gone(now_ns);
  }
  spdlog::debug("event=etcd_refused status={} endpoint={}", status, call.endpoint);
  // With 503 and 504 a member of etcd says that it cannot reach the other members, so it counts as out of reach.
  const bool is_silent = status == 503 || status == 504;
  fail(call, is_silent ? EtcdError::unreachable : EtcdError::refused, now_ns);
}

void EtcdCalls::on_line(std::uint64_t id, std::string_view line, std::int64_t now_ns) {
  const auto found = calls_.find(id);
  if (found == calls_.end() || !found->second.def.on_change || line.empty()) return;
  // The copy is needed because on_change may stop the call, which erases it from calls_.
  const Call call = found->second;
  const auto answer = etcd::parse_watch(line);
  if (answer) {
    failures_ = 0;
    if (call.def.on_change(*answer, now_ns)) return;
  }
  stop(id);
  fail(call, answer ? EtcdError::refused : EtcdError::malformed, now_ns);
}

void EtcdCalls::on_error(std::uint64_t id, EtcdError error, std::int64_t now_ns) {
  const auto found = calls_.find(id);
  if (found == calls_.end()) return;
  const Call call = std::move(found->second);
  calls_.erase(found);
  fail(call, error, now_ns);
}

void EtcdCalls::warn_of(const std::string& error) {
  spdlog::warn("event=etcd_malformed detail=\"{}\"", error);
}

void EtcdCalls::fail(const Call& call, EtcdError error, std::int64_t now_ns) {
  counter_of(*counters_, error).add();
  // One dead endpoint fails many calls at once; without generations each of them would skip an endpoint.
  if (call.generation == generation_) turn_to_next_endpoint(call.endpoint, error, now_ns);
  if (call.def.on_failure) call.def.on_failure(error, now_ns);
}

// The next endpoint is asked at once. When every endpoint has failed in turn, there is a pause, twice as long after
// each such round. An answer that is too long is no failure of the endpoint: every other endpoint would give the same
// answer.
void EtcdCalls::turn_to_next_endpoint(std::size_t failed, EtcdError error, std::int64_t now_ns) {
  ++generation_;
  endpoint_ = (endpoint_ + 1) % def_->endpoint_count;
  if (error == EtcdError::oversize) {
    retry_at_ns_ = now_ns + kBackoffMin_ns;
    return;
  }
  ++failures_;
  if (failures_ == def_->endpoint_count) spdlog::warn("event=etcd_unreachable");
  if (failures_ % def_->endpoint_count == 0) {
    const std::size_t rounds = failures_ / def_->endpoint_count;
    // The pause is at most a ninth of the lease (1 s with the default of 9 s): a pause that is longer than the lease
    // would end the lease by itself.
    const std::int64_t max_ns = std::min(kBackoffMax_ns, def_->lease_ns() / 9);
    // The shift by 6 at most gives 3.2 s, which exceeds kBackoffMax_ns, and keeps the number from overflowing.
    const std::int64_t wait_ns = std::min(max_ns, kBackoffMin_ns << std::min<std::size_t>(rounds - 1, 6));
    // The jitter keeps the servers of a fleet from asking an etcd that has come back all at the same moment.
    retry_at_ns_ = now_ns + static_cast<std::int64_t>(static_cast<double>(wait_ns) * jitter());
  }
  // A watch has no deadline, so it would wait at a dead endpoint forever: it is stopped, and begins again at the next
  // one. There is at most one watch.
  const auto watch = std::ranges::find_if(
      calls_, [failed](const auto& entry) { return entry.second.def.on_change && entry.second.endpoint == failed; });
  if (watch != calls_.end()) stop(watch->first);
}

}  // namespace hairnet::server
