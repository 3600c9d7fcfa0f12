#include "server/agones/sidecar.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "core/assert.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server::agones {
namespace {

constexpr std::int64_t kMs = 1'000'000, kSecond_ns = 1'000'000'000;
// A call without an answer for this long fails: the sidecar is on the same machine, so no answer will come any more.
constexpr std::int64_t kCallTimeout_ns = 2 * kSecond_ns;
// Agones gets a sign of life this often.
constexpr std::int64_t kHealthInterval_ns = 2 * kSecond_ns;
// Two changes of the state are at least this far apart: rooms may begin and end faster than Kubernetes can follow.
constexpr std::int64_t kStateInterval_ns = kSecond_ns;
// A changed number of rooms is reported at most this often.
constexpr std::int64_t kRoomsInterval_ns = 2 * kSecond_ns;
// While Agones has no address for this server yet, it is asked this often.
constexpr std::int64_t kAddressInterval_ns = kSecond_ns;
// A server must be without a room for this long before Agones may end it: somebody may be about to come back.
constexpr std::int64_t kUnusedFor_ns = 5 * kSecond_ns;
// The wait before the next try after a first failure. Each further failure doubles it, up to 0.5 s * 2^5 = 16 s.
constexpr std::int64_t kBackoffMin_ns = 500 * kMs;
constexpr int kBackoffDoublingsMax = 5;

// The words of the log for State, Duty and SidecarError, in their order.
constexpr std::array<const char*, 4> kStateNames{"none", "ready", "allocated", "shutdown"};
constexpr std::array<const char*, 4> kDutyNames{"health", "state", "rooms", "address"};
constexpr std::array<const char*, 6> kErrorNames{"unreachable", "timeout",   "broken",
                                                 "refused",     "malformed", "oversize"};

Counter& counter_of(AgonesCounters& counters, SidecarError error) {
  switch (error) {
    case SidecarError::unreachable:
      return counters.requests_failed_unreachable;
    case SidecarError::timeout:
      return counters.requests_failed_timeout;
    case SidecarError::broken:
      return counters.requests_failed_broken;
    case SidecarError::refused:
      return counters.requests_failed_refused;
    case SidecarError::oversize:
      return counters.requests_failed_oversize;
    case SidecarError::malformed:
      break;
  }
  return counters.requests_failed_malformed;
}

}  // namespace

Sidecar::Sidecar(const SidecarDef& def, SidecarTransport& transport, AgonesCounters& counters)
    : def_(def), transport_(&transport), counters_(&counters), random_(def.seed) {
  counters_->gauges.up.set(0);
  counters_->gauges.allocated.set(0);
}

void Sidecar::poll(const ServerNow& server, std::int64_t now_ns) {
  for (std::size_t duty = 0; duty < kDutyCount; ++duty) {
    Task& task = tasks_[duty];
    if (task.call == 0 || now_ns < task.deadline_ns) continue;
    transport_->cancel(std::exchange(task.call, 0));
    fail(static_cast<Duty>(duty), SidecarError::timeout, {}, now_ns);
  }
  // A server whose ticks hang sends no sign of life, and Agones replaces it.
  if (server.has_ticks_on_time && may_start(health_duty, now_ns)) start(health_duty, health(), now_ns);
  if (def_.asks_for_address && !address_ && may_start(address_duty, now_ns)) start(address_duty, game_server(), now_ns);
  const State wanted = wanted_state(server, now_ns);
  // While the server drains its state stays as it is: Agones must not allocate it again.
  const bool is_silent = wanted == State::none || (server.drains && wanted != State::shutdown);
  if (!is_silent && (wanted != state_ || !is_state_known_) && may_start(state_duty, now_ns)) {
    sent_state_ = wanted;
    // A call that times out may still have been executed, so the state is told again until one call succeeds.
    is_state_known_ = false;
    start(state_duty, wanted == State::ready ? ready() : wanted == State::allocated ? allocate() : shutdown(), now_ns);
  }
  // Agones refuses a count above the capacity.
  const std::size_t rooms = std::min(server.rooms, def_.room_count_max);
  if (state_ != State::none && !server.drains && rooms_ != rooms && may_start(rooms_duty, now_ns)) {
    sent_rooms_ = rooms;
    rooms_.reset();
    start(rooms_duty, set_rooms(rooms, def_.room_count_max), now_ns);
  }
}

Sidecar::State Sidecar::wanted_state(const ServerNow& server, std::int64_t now_ns) {
  if (shutdown_begun_ns_) return State::shutdown;
  if (server.rooms > 0) used_ns_ = now_ns;
  if (server.drains) return state_;
  // The first state is ready, even if a room exists already.
  if (state_ == State::none) return server.takes_clients ? State::ready : State::none;
  if (server.rooms > 0) return State::allocated;
  const bool is_unused = server.takes_clients && now_ns - used_ns_ >= kUnusedFor_ns;
  return state_ == State::allocated && is_unused ? State::ready : state_;
}

void Sidecar::shut_down(std::int64_t now_ns) {
  if (shutdown_begun_ns_) return;
  shutdown_begun_ns_ = now_ns;
  // The shutdown must not wait for a call under way, or for its next try.
  Task& task = tasks_[state_duty];
  if (task.call != 0) transport_->cancel(task.call);
  task = {};
}

bool Sidecar::is_shut_down(std::int64_t now_ns) const {
  return shutdown_begun_ns_ && (state_ == State::shutdown || now_ns - *shutdown_begun_ns_ >= kShutdownPatience_ns);
}

void Sidecar::start(Duty duty, Request request, std::int64_t now_ns) {
  counters_->requests.add();
  Task& task = tasks_[duty];
  // Numbers are never used again, so a late answer to a call that was given up finds no task.
  task.call = ++last_call_;
  task.deadline_ns = now_ns + kCallTimeout_ns;
  transport_->send(task.call, std::move(request));
}

std::optional<Sidecar::Duty> Sidecar::duty_of(std::uint64_t call) const {
  const auto found = std::ranges::find(tasks_, call, &Task::call);
  if (call == 0 || found == tasks_.end()) return std::nullopt;
  return static_cast<Duty>(found - tasks_.begin());
}

void Sidecar::on_answer(std::uint64_t call, int status, std::string_view body, std::int64_t now_ns) {
  const std::optional<Duty> duty = duty_of(call);
  if (!duty) return;
  tasks_[*duty].call = 0;
  note_reached(true);
  if (status == 200) return succeed(*duty, body, now_ns);
  fail(*duty, SidecarError::refused, "status " + std::to_string(status) + ": " + std::string(body), now_ns);
}

void Sidecar::on_error(std::uint64_t call, SidecarError error, std::int64_t now_ns) {
  const std::optional<Duty> duty = duty_of(call);
  if (!duty) return;
  tasks_[*duty].call = 0;
  fail(*duty, error, {}, now_ns);
}

void Sidecar::succeed(Duty duty, std::string_view body, std::int64_t now_ns) {
  Task& task = tasks_[duty];
  switch (duty) {
    case health_duty:
      task.due_ns = now_ns + kHealthInterval_ns;
      break;
    case state_duty:
      task.due_ns = now_ns + kStateInterval_ns;
      state_ = sent_state_;
      is_state_known_ = true;
      counters_->gauges.allocated.set(state_ == State::allocated ? 1 : 0);
      spdlog::info("event=agones_state state={}", kStateNames[static_cast<std::size_t>(state_)]);
      break;
    case rooms_duty:
      task.due_ns = now_ns + kRoomsInterval_ns;
      rooms_ = sent_rooms_;
      break;
    case address_duty: {
      Result<std::optional<ServerAddress>> address = parse_address(body);
      if (!address) return fail(duty, SidecarError::malformed, address.error(), now_ns);
      task.due_ns = now_ns + kAddressInterval_ns;
      address_ = std::move(*address);
      if (address_) spdlog::info("event=agones_address host={} port={}", log_text(address_->host), address_->port);
      break;
    }
    case kDutyCount:
      HAIRNET_ASSERT(false);
  }
  task.failures = 0;
  warned_of_[duty].clear();
}

void Sidecar::fail(Duty duty, SidecarError error, const std::string& detail, std::int64_t now_ns) {
  counter_of(*counters_, error).add();
  Task& task = tasks_[duty];
  // Waits grow so that a sidecar in trouble is left alone; the random part keeps the servers of a machine from calling
  // together.
  const std::int64_t wait_ns = kBackoffMin_ns << std::min(task.failures++, kBackoffDoublingsMax);
  task.due_ns = now_ns + static_cast<std::int64_t>(static_cast<double>(wait_ns) * random_.between(0.5, 1));
  // Agones ends a server whose sign of life is late, so the next try comes after kHealthInterval_ns at most.
  if (duty == health_duty) task.due_ns = std::min(task.due_ns, now_ns + kHealthInterval_ns);
  // The sidecar has answered, but with an error or with something else than expected. The cause lies in the settings or
  // the version, so a warning names the duty.
  if (error == SidecarError::refused || error == SidecarError::malformed || error == SidecarError::oversize) {
    const std::string text = kErrorNames[static_cast<std::size_t>(error)] + detail;
    if (std::exchange(warned_of_[duty], text) != text)
      spdlog::warn("event=agones_refused duty={} reason={} detail={}", kDutyNames[duty],
                   kErrorNames[static_cast<std::size_t>(error)], log_text(detail));
  } else {
    note_reached(false);
  }
}

void Sidecar::note_reached(bool is_reached) {
  if (std::exchange(is_reached_, is_reached) == is_reached) return;
  counters_->gauges.up.set(is_reached ? 1 : 0);
  if (is_reached)
    spdlog::info("event=agones_reached");
  else
    spdlog::warn("event=agones_unreachable");
}

}  // namespace hairnet::server::agones
