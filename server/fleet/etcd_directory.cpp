#include "server/fleet/etcd_directory.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

constexpr std::int64_t kMs = 1'000'000, kSecond_ns = 1'000'000'000;
constexpr std::int64_t kRequestTimeoutMin_ns = 200 * kMs, kRequestTimeoutMax_ns = 2 * kSecond_ns;
constexpr std::int64_t kListTimeout_ns = 2 * kSecond_ns;  // nobody is let in before the first list
constexpr std::int64_t kSilenceMax_ns = 20 * kSecond_ns;
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

std::int64_t lease_margin_ns(std::int64_t lease_ns) {
  return lease_ns / 10 + 200 * kMs;
}

EtcdDirectory::EtcdDirectory(const EtcdDirectoryDef& def, EtcdTransport& transport, FleetCounters& counters)
    : def_(def),
      transport_(&transport),
      counters_(&counters),
      keys_(def.fleet),
      random_(def.seed),
      lease_ns_(def.lease_s * kSecond_ns),
      silence_ns_(std::min(2 * lease_ns_, kSilenceMax_ns)),
      skipped_(counters),
      view_(keys_, skipped_),
      listed_(keys_, skipped_) {
  list_again();
  HAIRNET_ASSERT(def.server_id != 0);
  HAIRNET_ASSERT(def.endpoint_count > 0);
  HAIRNET_ASSERT(def.lease_s > 0);
  // All endpoints get their turn in a third of the lease.
  request_timeout_ns_ = std::clamp(lease_ns_ / (3 * static_cast<std::int64_t>(def.endpoint_count)),
                                   kRequestTimeoutMin_ns, kRequestTimeoutMax_ns);
  status_.id = def.server_id;
  status_.address = def.address;
}

Placement EtcdDirectory::where(std::string_view name, std::int64_t now_ns) const {
  using Kind = Placement::Kind;
  if (is_stopping_) return {.kind = Kind::unavailable, .reason = "the server ends"};
  if (!has_address()) return {.kind = Kind::unavailable, .reason = "the server does not know its public address yet"};
  if (const auto own = rooms_.find(name); own != rooms_.end()) {
    const Room& room = own->second;
    if (room.state != Room::State::owned) return {.kind = Kind::pending};
    // Nobody enters before what was kept of the room is known.
    if (!room.is_told) return {.kind = Kind::pending, .server_id = status_.id, .claim = room.claim};
    if (fence_.is_open(now_ns))
      return {.kind = Kind::here, .server_id = status_.id, .address = status_.address, .claim = room.claim};
    return {.kind = Kind::unavailable, .claim = room.claim, .reason = "the lease has run out: etcd does not answer"};
  }
  const FleetView::Owner* owner = view_.owner(name);
  if (owner && owner->server_id != status_.id) {
    const ServerStatus* server = view_.server(owner->server_id);
    if (!server) return {.kind = Kind::pending, .server_id = owner->server_id, .claim = owner->claim};
    return {.kind = Kind::elsewhere, .server_id = server->id, .address = server->address, .claim = owner->claim};
  }
  const auto hand_over = hand_overs_.find(name);
  const bool is_handed_over = hand_over != hand_overs_.end();
  // The others hear of a release no later than this server's own copy does: a client that was sent on before that could
  // be sent back here.
  if (owner && (status_.draining || is_handed_over)) return {.kind = Kind::pending};
  if (is_handed_over) {
    if (!hand_over->second.is_told) return {.kind = Kind::pending};
    const ServerStatus* to = view_.server(hand_over->second.to);
    if (to && !to->draining) return {.kind = Kind::elsewhere, .server_id = to->id, .address = to->address};
  }
  if (!is_reachable()) return {.kind = Kind::unavailable, .reason = "etcd does not answer"};
  return {.kind = is_listed_ ? Kind::unowned : Kind::pending};
}

bool EtcdDirectory::holds(std::string_view name, std::int64_t now_ns) const {
  if (!fence_.is_open(now_ns)) return false;
  const auto own = rooms_.find(name);
  return own != rooms_.end() && own->second.state == Room::State::owned;
}

void EtcdDirectory::drain(std::int64_t) {
  status_.draining = true;
  tell_at_ns_ = 0;
}

void EtcdDirectory::pass_on(std::vector<ContentHash> grooms) {
  if (grooms.size() > kPassedGroomsMax) grooms.resize(kPassedGroomsMax);
  status_.grooms = std::move(grooms);
}

void EtcdDirectory::stop(std::int64_t) {
  if (is_stopping_) return;
  is_stopping_ = true;
  fence_.close();
  rooms_.clear();
  due_.clear();
  kept_due_.clear();
  hand_overs_.clear();
  while (!calls_.empty()) stop_call(calls_.begin()->first);
  watch_ = 0;
}

void EtcdDirectory::poll(std::int64_t now_ns) {
  if (!has_address()) return;
  end_overdue_calls(now_ns);
  note_fence(now_ns);
  poll_lease(now_ns);
  if (!is_stopping_) {
    if (now_ns >= retry_at_ns_) {
      poll_status(now_ns);
      poll_view(now_ns);
    }
    poll_rooms(now_ns);
    poll_hand_overs(now_ns);
    if (fence_.is_open(now_ns) && now_ns >= retry_at_ns_) poll_kept(now_ns);
  }
  set_gauges(now_ns);
}

std::vector<FleetEvent> EtcdDirectory::take_events() {
  for (const FleetEvent& event : events_) {
    const auto found = rooms_.find(event.room);
    if (event.kind == FleetEvent::Kind::room_claimed && found != rooms_.end()) found->second.is_told = true;
  }
  return std::exchange(events_, {});
}

std::vector<ServerStatus> EtcdDirectory::servers() const {
  std::vector<ServerStatus> all;
  for (const auto& [id, status] : view_.servers())
    if (id != status_.id) all.push_back(status);
  all.insert(std::ranges::lower_bound(all, status_.id, {}, &ServerStatus::id), status_);
  return all;
}

std::vector<RoomOwner> EtcdDirectory::rooms() const {
  std::vector<RoomOwner> all;
  for (const auto& [name, owner] : view_.rooms())
    all.push_back({.room = name, .server_id = owner.server_id, .claim = owner.claim});
  return all;
}

std::vector<std::string> EtcdDirectory::own_rooms() const {
  std::vector<std::string> own;
  for (const auto& [name, room] : rooms_)
    if (room.state == Room::State::owned) own.push_back(name);
  return own;
}

std::uint64_t EtcdDirectory::start(Purpose purpose, etcd::Request request, std::int64_t now_ns, std::string room) {
  Call call{.purpose = purpose,
            .endpoint = endpoint_,
            .generation = generation_,
            .sent_ns = now_ns,
            .deadline_ns = now_ns + (purpose == Purpose::list ? kListTimeout_ns : request_timeout_ns_),
            .lease = lease_,
            .room = std::move(room)};
  // A keep-alive goes to every endpoint in turn before it goes to one for the second time.
  if (purpose == Purpose::keep_alive || purpose == Purpose::ask_lease)
    while (silent_.contains(call.endpoint)) call.endpoint = (call.endpoint + 1) % def_.endpoint_count;
  const std::uint64_t id = ++last_call_;
  counters_->requests.add();
  transport_->send({.id = id,
                    .endpoint = call.endpoint,
                    .path = std::move(request.path),
                    .body = std::move(request.body),
                    .is_stream = purpose == Purpose::watch});
  calls_.emplace(id, std::move(call));
  return id;
}

void EtcdDirectory::stop_call(std::uint64_t id) {
  transport_->cancel(id);
  calls_.erase(id);
}

bool EtcdDirectory::is_under_way(Purpose purpose) const {
  return std::ranges::any_of(calls_, [purpose](const auto& call) { return call.second.purpose == purpose; });
}

void EtcdDirectory::end_overdue_calls(std::int64_t now_ns) {
  std::vector<std::uint64_t> overdue;
  for (const auto& [id, call] : calls_)
    if (call.purpose != Purpose::watch && now_ns >= call.deadline_ns) overdue.push_back(id);
  for (const std::uint64_t id : overdue) {
    const auto found = calls_.find(id);
    if (found == calls_.end()) continue;
    const Call call = found->second;
    stop_call(id);
    fail(call, EtcdFault::timeout, now_ns);
  }
}

void EtcdDirectory::on_answer(std::uint64_t id, int status, std::string_view body, std::int64_t now_ns) {
  const auto found = calls_.find(id);
  if (found == calls_.end()) return;
  const Call call = std::move(found->second);
  calls_.erase(found);
  if (id == watch_) watch_ = 0;
  if (status == 200 && call.purpose != Purpose::watch) return take(call, body, now_ns);
  if (etcd::is_lease_gone(status, body)) {
    failures_ = 0;
    retry_room(call);
    // A release needs no lease, but for what is put beside it.
    if (call.purpose == Purpose::keep || call.purpose == Purpose::release) return lose_kept_lease();
    if (call.lease != 0 && call.lease == lease_) lose_lease(now_ns);
    return;
  }
  spdlog::debug("event=etcd_refused status={} endpoint={}", status, call.endpoint);
  // 503 and 504: this member of etcd has lost the others.
  const bool is_silent = status == 503 || status == 504;
  fail(call, is_silent ? EtcdFault::unreachable : EtcdFault::refused, now_ns);
}

void EtcdDirectory::on_line(std::uint64_t id, std::string_view line, std::int64_t now_ns) {
  const auto found = calls_.find(id);
  if (found == calls_.end() || found->second.purpose != Purpose::watch || line.empty()) return;
  const auto answer = etcd::parse_watch(line);
  if (answer) {
    failures_ = 0;
    return take_watch(id, *answer, now_ns);
  }
  const Call call = found->second;
  stop_call(id);
  watch_ = 0;
  fail(call, EtcdFault::malformed, now_ns);
}

void EtcdDirectory::on_fault(std::uint64_t id, EtcdFault fault, std::int64_t now_ns) {
  const auto found = calls_.find(id);
  if (found == calls_.end()) return;
  const Call call = std::move(found->second);
  calls_.erase(found);
  if (id == watch_) watch_ = 0;
  fail(call, fault, now_ns);
}

void EtcdDirectory::fail(const Call& call, EtcdFault fault, std::int64_t now_ns) {
  counter_of(*counters_, fault).add();
  if (call.generation == generation_) turn_to_next_endpoint(call, fault, now_ns);
  if (call.purpose == Purpose::keep_alive || call.purpose == Purpose::ask_lease)
    note_failed_keep_alive(call, fault, now_ns);
  const bool is_oversize = fault == EtcdFault::oversize;
  if (call.purpose == Purpose::list && is_oversize && list_page_ > 0)
    list_page_ = list_page_ > 1 ? std::max<std::int64_t>(list_page_ / 4, 1) : 0;
  else if (call.purpose == Purpose::list)
    list_again();
  // A watch that goes on where it was would get the same line again.
  if (call.purpose == Purpose::watch && (is_oversize || fault == EtcdFault::malformed)) list_again();
  if (call.purpose == Purpose::claim && is_oversize) return shorten_claim(call);
  retry_room(call);
}

// It gets its turn at once; when all have had one, there is a pause, each time longer. An answer that is too long is an
// answer, and as long elsewhere.
void EtcdDirectory::turn_to_next_endpoint(const Call& call, EtcdFault fault, std::int64_t now_ns) {
  ++generation_;
  endpoint_ = (endpoint_ + 1) % def_.endpoint_count;
  if (fault == EtcdFault::oversize) {
    retry_at_ns_ = now_ns + kBackoffMin_ns;
    return;
  }
  ++failures_;
  if (failures_ == def_.endpoint_count) spdlog::warn("event=etcd_unreachable");
  if (failures_ % def_.endpoint_count == 0) {
    const std::size_t rounds = failures_ / def_.endpoint_count;
    const std::int64_t most_ns = std::min(kBackoffMax_ns, lease_ns_ / 9);
    const std::int64_t wait_ns = std::min(most_ns, kBackoffMin_ns << std::min<std::size_t>(rounds - 1, 6));
    retry_at_ns_ = now_ns + static_cast<std::int64_t>(static_cast<double>(wait_ns) * random_.between(0.5, 1));
  }
  if (const auto watch = calls_.find(watch_); watch != calls_.end() && watch->second.endpoint == call.endpoint) {
    stop_call(watch_);
    watch_ = 0;
  }
}

void EtcdDirectory::take(const Call& call, std::string_view body, std::int64_t now_ns) {
  const auto give = [&](const auto& answer, auto&& use) {
    if (!answer) {
      spdlog::warn("event=etcd_malformed detail=\"{}\"", answer.error());
      return fail(call, EtcdFault::malformed, now_ns);
    }
    failures_ = 0;
    use(*answer);
  };
  switch (call.purpose) {
    case Purpose::grant:
      return give(etcd::parse_grant(body), [&](const auto& answer) { take_lease(call, answer, now_ns); });
    case Purpose::keep_alive:
      return give(etcd::parse_keep_alive(body), [&](const auto& answer) { take_lease(call, answer, now_ns); });
    case Purpose::ask_lease:
      return give(etcd::parse_time_to_live(body), [&](const auto& answer) { take_lease(call, answer, now_ns); });
    case Purpose::revoke:
      lease_ = 0;
      return;
    case Purpose::publish:
      return give(etcd::parse_put(body), [&](std::int64_t) {
        if (call.lease == lease_) told_ = telling_;
      });
    case Purpose::list:
      return give(etcd::parse_range(body), [&](const auto& answer) { take_list(answer); });
    case Purpose::claim:
      return give(etcd::parse_txn(body), [&](const auto& answer) { take_claim(call, answer, now_ns); });
    case Purpose::release:
      return give(etcd::parse_txn(body), [&](const auto&) { take_release(call, now_ns); });
    case Purpose::keep:
      return give(etcd::parse_txn(body), [&](const auto&) { end_keep(call, true); });
    case Purpose::keep_grant:
      return give(etcd::parse_grant(body), [&](const auto& answer) { take_kept_lease(call, answer); });
    case Purpose::keep_renewal:
      return give(etcd::parse_keep_alive(body), [&](const auto& answer) { take_kept_lease(call, answer); });
    case Purpose::watch:
      break;
  }
}

void EtcdDirectory::set_gauges(std::int64_t now_ns) {
  FleetGauges& gauges = counters_->gauges;
  gauges.etcd_up.set(is_reachable() ? 1 : 0);
  gauges.lease_valid.set(fence_.is_open(now_ns) ? 1 : 0);
  gauges.servers.set(static_cast<double>(view_.servers().size()));
  gauges.rooms.set(static_cast<double>(view_.rooms().size()));
  gauges.rooms_owned.set(static_cast<double>(rooms_.size()));
}

}  // namespace hairnet::server
