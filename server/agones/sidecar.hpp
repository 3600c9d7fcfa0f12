#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "core/random.hpp"
#include "server/agones/agones_counters.hpp"
#include "server/agones/sidecar_transport.hpp"

namespace hairnet::server::agones {

struct SidecarDef {
  // The capacity of the counter of rooms, which Agones is told.
  std::size_t room_count_max = 0;
  // The public address is asked for, because the settings do not have it.
  bool asks_for_address = false;
  // Seeds the jitter between tries.
  std::uint64_t seed = 0;
};

// The state of this server, which poll() reports to the sidecar.
struct ServerNow {
  // The server takes clients, and its directory works.
  bool takes_clients = false;
  // Ticks run on time, so the server does not hang.
  bool has_ticks_on_time = false;
  // The server gives up its rooms and is about to end.
  bool drains = false;
  std::size_t rooms = 0;
};

// This server as Agones sees it, by way of the sidecar: alive, ready, in use, ended. Every duty has one call at a time;
// one that fails is tried again, later each time. Nothing here stops the server. I/O thread.
class Sidecar final : public SidecarSink {
 public:
  // `transport` and `counters` must outlive the sidecar.
  Sidecar(const SidecarDef& def, SidecarTransport& transport, AgonesCounters& counters);

  // Starts the calls that are due, and gives up those without an answer. Call it some times a second.
  void poll(const ServerNow& server, std::int64_t now_ns);
  // The server has drained, so Agones may end the pod. Further calls do nothing.
  void shut_down(std::int64_t now_ns);
  // Agones knows of the end, or has not answered for kShutdownPatience_ns.
  [[nodiscard]] bool is_shut_down(std::int64_t now_ns) const;
  // Where clients reach this server, once it is known.
  [[nodiscard]] const std::optional<ServerAddress>& address() const { return address_; }

  // These two implement SidecarSink: the transport calls them.
  void on_answer(std::uint64_t call, int status, std::string_view body, std::int64_t now_ns) override;
  void on_error(std::uint64_t call, SidecarError error, std::int64_t now_ns) override;

  // A server that ends must not wait longer for a sidecar that does not answer: Kubernetes ends the pod in any case.
  static constexpr std::int64_t kShutdownPatience_ns = 2'000'000'000;

 private:
  // What Agones takes this server for. States go forward, except that allocated returns to ready when the last room has
  // ended.
  enum class State : std::uint8_t { none, ready, allocated, shutdown };
  // The kinds of calls: the sign of life, the state, the number of rooms, and the question for the public address. Each
  // has a Task.
  enum Duty : std::uint8_t { health_duty, state_duty, rooms_duty, address_duty, kDutyCount };
  struct Task {
    // The number of the call under way; zero: there is none.
    std::uint64_t call = 0;
    // The call fails without an answer by deadline_ns; the next one begins no sooner than due_ns.
    std::int64_t deadline_ns = 0, due_ns = 0;
    // The number of failures since the last success.
    int failures = 0;
  };

  // The state that Agones should know now.
  [[nodiscard]] State wanted_state(const ServerNow& server, std::int64_t now_ns);
  [[nodiscard]] bool may_start(Duty duty, std::int64_t now_ns) const {
    return tasks_[duty].call == 0 && now_ns >= tasks_[duty].due_ns;
  }
  // Sends the call of a duty.
  void start(Duty duty, Request request, std::int64_t now_ns);
  // The call of a duty has succeeded, or has failed and is tried again after a pause that grows.
  void succeed(Duty duty, std::string_view body, std::int64_t now_ns);
  void fail(Duty duty, SidecarError error, const std::string& detail, std::int64_t now_ns);
  // Sets the gauge `up`, and logs one line when the sidecar stops answering and one when it answers again.
  void note_reached(bool is_reached);
  [[nodiscard]] std::optional<Duty> duty_of(std::uint64_t call) const;

  SidecarDef def_;
  SidecarTransport* transport_;
  AgonesCounters* counters_;
  Random random_;
  std::array<Task, kDutyCount> tasks_;
  std::uint64_t last_call_ = 0;
  // Agones has accepted `state_`; the newest call asks for `sent_state_`.
  State state_ = State::none, sent_state_ = State::none;
  // state_ is what Agones has. False from the start of a call until one succeeds, because a call that fails may have
  // been executed.
  bool is_state_known_ = true;
  // A room last existed at this time.
  std::int64_t used_ns_ = 0;
  // The number of rooms that Agones has accepted last; none: it is not known, because no call has succeeded since one
  // began.
  std::optional<std::size_t> rooms_;
  // The number of rooms in the newest call.
  std::size_t sent_rooms_ = 0;
  std::optional<ServerAddress> address_;
  // shut_down() was called first at this time.
  std::optional<std::int64_t> shutdown_begun_ns_;
  // Whether the last call reached the sidecar; none: no call has ended yet.
  std::optional<bool> is_reached_;
  // The newest warning of each duty, so that the same one is not logged again.
  std::array<std::string, kDutyCount> warned_of_;
};

}  // namespace hairnet::server::agones
