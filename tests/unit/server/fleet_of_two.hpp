#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/fleet/etcd_directory.hpp"
#include "tests/support/simulated_etcd.hpp"

namespace hairnet::server {

// One server's directory of the fleet, beside a simulated etcd. Calls are executed and answered in step(); the
// switches below make its line to etcd fail in several ways.
class FleetMember final : public EtcdTransport {
 public:
  FleetMember(support::SimulatedEtcd& etcd, EtcdDirectoryDef def) : etcd_(&etcd), directory(def, *this, counters) {}

  void send(EtcdCall call) override { sent_.push_back(std::move(call)); }
  void cancel(std::uint64_t call) override {
    cancelled.insert(call);
    if (streams_.contains(call)) etcd_->end_watch(streams_[call]);
  }
  void step(std::int64_t now_ns) {
    directory.poll(now_ns);
    for (EtcdCall& call : std::exchange(sent_, {})) {
      last_body = call.body;
      if (cancelled.contains(call.id) || is_silent) continue;
      if (is_cut || etcd_->is_down()) {
        directory.on_error(call.id, EtcdError::unreachable, now_ns);
      } else if (call.is_stream) {
        const std::uint64_t id = call.id;
        streams_[id] = etcd_->watch(call.body, [this, id](const std::string& line) { lines_.emplace_back(id, line); });
      } else if (answers_with) {
        directory.on_answer(call.id, answers_with->status, answers_with->body, now_ns);
      } else {
        const auto answer = etcd_->handle(call.path, call.body, now_ns);
        const bool is_lost = is_deaf || (is_deaf_to_keep_alives && call.path == "/v3/lease/keepalive");
        if (!is_lost) answers_.push_back({now_ns + late_ns, call.id, answer});
      }
    }
    while (!answers_.empty() && now_ns >= answers_.front().at_ns) {
      const Answer answer = std::move(answers_.front());
      answers_.pop_front();
      if (cancelled.contains(answer.call)) continue;
      if (answer.answer.body.size() > answer_bytes_max)
        directory.on_error(answer.call, EtcdError::oversize, now_ns);
      else
        directory.on_answer(answer.call, answer.answer.status, answer.answer.body, now_ns);
    }
    while (!lines_.empty() && !holds_lines) {
      const auto [id, line] = lines_.front();
      lines_.pop_front();
      if (is_deaf) continue;
      if (line.size() > answer_bytes_max)
        directory.on_error(id, EtcdError::oversize, now_ns);
      else
        directory.on_line(id, line, now_ns);
    }
    if (!takes_events) return;
    for (FleetEvent& event : directory.take_events()) events.push_back(std::move(event));
  }
  // Ends all watches at etcd. No error reaches the directory, as when a connection dies silently.
  void kill_watch() {
    for (const auto& [call, stream] : streams_) etcd_->end_watch(stream);
  }
  [[nodiscard]] std::size_t count(FleetEvent::Kind kind) const {
    return static_cast<std::size_t>(
        std::count_if(events.begin(), events.end(), [kind](const FleetEvent& event) { return event.kind == kind; }));
  }

  // A call fails at once when cut, and is lost before etcd when silent. The lines of watches wait while they are held,
  // and events stay in the directory unless taken.
  bool is_cut = false, is_silent = false, holds_lines = false, takes_events = true;
  // etcd hears a deaf member and executes its calls, but all answers, or those to keep-alives, are lost.
  bool is_deaf = false;
  bool is_deaf_to_keep_alives = false;
  // Answers come later by this time.
  std::int64_t late_ns = 0;
  std::size_t answer_bytes_max = etcd::kAnswerBytesMax;
  // Takes the place of all answers of etcd.
  std::optional<support::SimulatedEtcd::Answer> answers_with;
  std::vector<FleetEvent> events;
  std::set<std::uint64_t> cancelled;
  std::string last_body;
  FleetCounters counters;

 private:
  struct Answer {
    std::int64_t at_ns = 0;
    std::uint64_t call = 0;
    support::SimulatedEtcd::Answer answer;
  };
  support::SimulatedEtcd* etcd_;
  std::vector<EtcdCall> sent_;
  std::deque<Answer> answers_;
  std::deque<std::pair<std::uint64_t, std::string>> lines_;
  std::map<std::uint64_t, std::uint64_t> streams_;

 public:
  EtcdDirectory directory;
};

// Two servers beside one etcd, and a room, the hall, that either may own. Leases last 9 s (lease_s of
// EtcdDirectoryDef).
class FleetOfTwo : public testing::Test {
 protected:
  using Kind = Placement::Kind;
  static constexpr std::int64_t kMs = 1'000'000, kSecond_ns = 1'000'000'000;

  static EtcdDirectoryDef def(std::uint64_t id) {
    EtcdDirectoryDef def;
    def.server_id = id;
    def.address = {.host = "server-" + std::to_string(id), .port = 7420, .page = ""};
    def.fleet = "test";
    def.rooms_max = 100;
    return def;
  }
  // Runs etcd and the servers in steps of 20 ms. The hall never has two owners.
  void run(double seconds, bool with_second = true) {
    const std::int64_t end_ns = now_ns_ + static_cast<std::int64_t>(seconds * 1e9);
    for (; now_ns_ < end_ns; now_ns_ += 20 * kMs) {
      if (!etcd_.is_down()) etcd_.advance(now_ns_);
      first_.step(now_ns_);
      if (with_second) second_.step(now_ns_);
      EXPECT_FALSE(first_.directory.holds("hall", now_ns_) && second_.directory.holds("hall", now_ns_));
    }
  }
  // Expects that the first server, which has the hall and a bad line to etcd, stops. The second one can have the hall
  // within two leases, 18 s, from then on.
  void expect_the_hall_to_move() {
    while (first_.directory.holds("hall", now_ns_)) run(0.02);
    const std::int64_t stopped_ns = now_ns_;
    while (kind(second_) != Kind::unowned && now_ns_ - stopped_ns < 18 * kSecond_ns) run(0.02);
    EXPECT_TRUE(second_.directory.claim("hall", now_ns_));
    run(0.1);
    EXPECT_EQ(kind(second_), Kind::here);
  }
  // Expects that the first server, whose line is good again, has lost the hall and can have another room.
  void expect_the_first_to_join_afresh() {
    run(4);
    EXPECT_EQ(first_.counters.leases_lost.value(), 1u);
    EXPECT_EQ(first_.count(FleetEvent::Kind::room_lost), 1u);
    EXPECT_EQ(kind(first_), Kind::elsewhere);
    EXPECT_TRUE(first_.directory.claim("attic", now_ns_));
    run(1);
    EXPECT_TRUE(first_.directory.holds("attic", now_ns_));
  }
  Kind kind(FleetMember& member) { return member.directory.where("hall", now_ns_).kind; }
  // Lets etcd be away for 3 s while the first server keeps a text of the hall. The lease of the room has ended when
  // etcd is back.
  void keep_while_etcd_is_away(const std::string& text) {
    etcd_.end_lease_of("/hairnet/test/rooms/hall");
    etcd_.go_down();
    run(3);
    first_.directory.keep("hall", text, now_ns_);
    etcd_.come_up(now_ns_);
    run(5);
  }

  std::int64_t now_ns_ = 1000 * kSecond_ns;
  support::SimulatedEtcd etcd_;
  FleetMember first_{etcd_, def(1)}, second_{etcd_, def(2)};
};

}  // namespace hairnet::server
