#include "server/fleet/etcd_directory.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>
#include <memory>
#include <set>
#include <string>

#include "server/fleet/local_directory.hpp"
#include "tests/support/simulated_etcd.hpp"

namespace hairnet::server {
namespace {

using Kind = Placement::Kind;
using testing::HasSubstr;
constexpr std::int64_t kMs = 1'000'000, kSecond_ns = 1'000'000'000;

// A directory beside a simulated etcd that answers at the next step.
class Member final : public EtcdTransport {
 public:
  Member(support::SimulatedEtcd& etcd, EtcdDirectoryDef def) : etcd_(&etcd), directory(def, *this, counters) {}

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
        directory.on_fault(call.id, EtcdFault::unreachable, now_ns);
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
        directory.on_fault(answer.call, EtcdFault::oversize, now_ns);
      else
        directory.on_answer(answer.call, answer.answer.status, answer.answer.body, now_ns);
    }
    while (!lines_.empty() && !holds_lines) {
      const auto [id, line] = lines_.front();
      lines_.pop_front();
      if (is_deaf) continue;
      if (line.size() > answer_bytes_max)
        directory.on_fault(id, EtcdFault::oversize, now_ns);
      else
        directory.on_line(id, line, now_ns);
    }
    if (!takes_events) return;
    for (FleetEvent& event : directory.take_events()) events.push_back(std::move(event));
  }
  // Without a word: the directory hears nothing of it.
  void kill_watch() {
    for (const auto& [call, stream] : streams_) etcd_->end_watch(stream);
  }
  [[nodiscard]] std::size_t count(FleetEvent::Kind kind) const {
    return static_cast<std::size_t>(
        std::count_if(events.begin(), events.end(), [kind](const FleetEvent& event) { return event.kind == kind; }));
  }

  bool is_cut = false, is_silent = false, holds_lines = false, takes_events = true;
  bool is_deaf = false;  // etcd hears it, and it hears nothing
  bool is_deaf_to_keep_alives = false;
  std::int64_t late_ns = 0;  // by which answers come later
  std::size_t answer_bytes_max = etcd::kAnswerBytesMax;
  std::optional<support::SimulatedEtcd::Answer> answers_with;  // instead of etcd's
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

class FleetOfTwo : public testing::Test {
 protected:
  static EtcdDirectoryDef def(std::uint64_t id) {
    EtcdDirectoryDef def;
    def.server_id = id;
    def.address = {.host = "server-" + std::to_string(id), .port = 7420, .page = ""};
    def.fleet = "test";
    def.rooms_max = 100;
    return def;
  }
  // In steps of 20 ms.
  void run(double seconds, bool with_second = true) {
    const std::int64_t end_ns = now_ns_ + static_cast<std::int64_t>(seconds * 1e9);
    for (; now_ns_ < end_ns; now_ns_ += 20 * kMs) {
      if (!etcd_.is_down()) etcd_.advance(now_ns_);
      first_.step(now_ns_);
      if (with_second) second_.step(now_ns_);
      EXPECT_FALSE(first_.directory.holds("hall", now_ns_) && second_.directory.holds("hall", now_ns_));
    }
  }
  // The first server has the hall and its line goes bad: another one can have it two leases after frames have stopped.
  void expect_the_hall_to_move() {
    while (first_.directory.holds("hall", now_ns_)) run(0.02);
    const std::int64_t stopped_ns = now_ns_;
    while (kind(second_) != Kind::unowned && now_ns_ - stopped_ns < 18 * kSecond_ns) run(0.02);
    EXPECT_TRUE(second_.directory.claim("hall", now_ns_));
    run(0.1);
    EXPECT_EQ(kind(second_), Kind::here);
  }
  // Its line is good again.
  void expect_the_first_to_join_afresh() {
    run(4);
    EXPECT_EQ(first_.counters.leases_lost.value(), 1u);
    EXPECT_EQ(first_.count(FleetEvent::Kind::room_lost), 1u);
    EXPECT_EQ(kind(first_), Kind::elsewhere);
    EXPECT_TRUE(first_.directory.claim("attic", now_ns_));
    run(1);
    EXPECT_TRUE(first_.directory.holds("attic", now_ns_));
  }
  Kind kind(Member& member) { return member.directory.where("hall", now_ns_).kind; }
  // The lease of the room ends meanwhile.
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
  Member first_{etcd_, def(1)}, second_{etcd_, def(2)};
};

TEST(EtcdDirectory, stays_out_of_the_fleet_until_it_knows_its_address) {
  support::SimulatedEtcd etcd;
  EtcdDirectoryDef def;
  def.server_id = 1;
  Member member(etcd, def);
  std::int64_t now_ns = 1000 * kSecond_ns;
  const auto run = [&] {
    for (int i = 0; i < 50; ++i, now_ns += 20 * kMs) member.step(now_ns);
  };
  run();
  EXPECT_EQ(member.counters.requests.value(), 0u);
  EXPECT_FALSE(member.directory.fence().is_open(now_ns));
  const Placement placement = member.directory.where("hall", now_ns);
  EXPECT_EQ(placement.kind, Kind::unavailable);
  EXPECT_THAT(placement.reason, HasSubstr("public address"));
  member.directory.set_address({.host = "203.0.113.7", .port = 7431, .page = ""});
  run();
  EXPECT_TRUE(member.directory.fence().is_open(now_ns));
  EXPECT_EQ(member.directory.servers().front().address.port, 7431);
  EXPECT_EQ(member.directory.where("hall", now_ns).kind, Kind::unowned);
}

TEST(EtcdDirectory, that_never_knew_its_address_stops_at_once) {
  support::SimulatedEtcd etcd;
  EtcdDirectoryDef def;
  def.server_id = 1;
  Member member(etcd, def);
  member.directory.drain(kSecond_ns);
  member.directory.stop(kSecond_ns);
  EXPECT_TRUE(member.directory.is_stopped());
}

TEST_F(FleetOfTwo, a_room_is_of_the_first_that_claims_it) {
  EXPECT_EQ(kind(first_), Kind::pending) << "nothing is known yet";
  run(1);
  EXPECT_EQ(kind(first_), Kind::unowned);
  EXPECT_TRUE(first_.directory.claim("hall", now_ns_));
  EXPECT_EQ(kind(first_), Kind::pending);
  run(0.1);
  EXPECT_EQ(kind(first_), Kind::here);
  EXPECT_TRUE(first_.directory.holds("hall", now_ns_));
  const Placement seen = second_.directory.where("hall", now_ns_);
  EXPECT_EQ(seen.kind, Kind::elsewhere);
  EXPECT_EQ(seen.address.host, "server-1");
  EXPECT_EQ(seen.claim, first_.directory.where("hall", now_ns_).claim);
  EXPECT_TRUE(second_.directory.claim("hall", now_ns_));
  run(0.1);
  EXPECT_EQ(second_.count(FleetEvent::Kind::claim_failed), 1u);
  EXPECT_EQ(second_.events.back().owner, 1u);
  EXPECT_EQ(second_.counters.claims_lost.value(), 1u);
  EXPECT_EQ(first_.directory.rooms(), (std::vector<RoomOwner>{{.room = "hall", .server_id = 1, .claim = seen.claim}}));
}

TEST_F(FleetOfTwo, a_released_room_is_free_for_the_other_with_a_greater_number) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  const std::int64_t before = first_.directory.where("hall", now_ns_).claim;
  first_.directory.release("hall", now_ns_);
  EXPECT_FALSE(first_.directory.holds("hall", now_ns_)) << "at once";
  run(0.2);
  second_.directory.claim("hall", now_ns_);
  run(0.2);
  EXPECT_EQ(kind(second_), Kind::here);
  EXPECT_GT(second_.directory.where("hall", now_ns_).claim, before);
  EXPECT_EQ(first_.directory.room_count(), 0u);
}

TEST_F(FleetOfTwo, a_room_is_among_a_servers_own_before_the_watch_shows_it) {
  run(1);
  first_.directory.claim("hall", now_ns_);
  first_.step(now_ns_);
  EXPECT_THAT(first_.directory.own_rooms(), testing::ElementsAre("hall"));
  EXPECT_THAT(second_.directory.own_rooms(), testing::IsEmpty());
  first_.directory.release("hall", now_ns_);
  EXPECT_THAT(first_.directory.own_rooms(), testing::IsEmpty()) << "at once";
}

TEST_F(FleetOfTwo, a_room_that_a_draining_server_gave_up_is_free_when_its_copy_shows_it) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.directory.drain(now_ns_);
  first_.directory.release("hall", now_ns_);
  first_.holds_lines = true;
  first_.step(now_ns_);
  EXPECT_EQ(first_.directory.room_count(), 0u) << "etcd has confirmed it";
  EXPECT_EQ(kind(first_), Kind::pending);
  first_.holds_lines = false;
  first_.step(now_ns_);
  EXPECT_EQ(kind(first_), Kind::unowned);
}

TEST_F(FleetOfTwo, hears_of_the_grooms_of_a_server_that_drains) {
  run(1);
  std::vector<ContentHash> grooms(70);
  for (std::size_t i = 0; i < grooms.size(); ++i) grooms[i][i % 32] = static_cast<std::uint8_t>(i);
  second_.directory.pass_on(grooms);
  second_.directory.drain(now_ns_);
  run(0.2);
  ASSERT_EQ(first_.count(FleetEvent::Kind::grooms_passed_on), 1u);
  EXPECT_EQ(second_.count(FleetEvent::Kind::grooms_passed_on), 0u) << "they are its own";
  grooms.resize(kPassedGroomsMax);
  EXPECT_EQ(first_.events.back().grooms, grooms) << "the first ones";
}

TEST_F(FleetOfTwo, a_room_that_is_handed_over_is_at_its_next_server_once_the_copy_shows_its_release) {
  run(1);
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.directory.hand_over("hall", 2, now_ns_);
  EXPECT_FALSE(first_.directory.holds("hall", now_ns_));
  EXPECT_EQ(kind(first_), Kind::pending);
  first_.holds_lines = true;
  run(0.5);
  EXPECT_EQ(first_.directory.room_count(), 0u) << "etcd has confirmed the release";
  EXPECT_EQ(kind(first_), Kind::pending) << "but other servers may not have heard of it";
  EXPECT_EQ(first_.count(FleetEvent::Kind::room_handed_over), 0u);
  first_.holds_lines = false;
  run(0.2);
  EXPECT_EQ(first_.count(FleetEvent::Kind::room_handed_over), 1u);
  const Placement placement = first_.directory.where("hall", now_ns_);
  EXPECT_EQ(placement.kind, Kind::elsewhere) << "though nobody has claimed it yet";
  EXPECT_EQ(placement.server_id, 2u);
  EXPECT_EQ(placement.address.host, "server-2");
  second_.directory.claim("hall", now_ns_);
  run(10);
  EXPECT_EQ(kind(second_), Kind::here);
  EXPECT_EQ(kind(first_), Kind::elsewhere);
  EXPECT_EQ(first_.count(FleetEvent::Kind::room_handed_over), 1u);
  EXPECT_EQ(first_.counters.rooms_handed_over.value(), 1u);
}

TEST_F(FleetOfTwo, a_room_whose_next_server_does_not_claim_it_is_free_again) {
  run(1);
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.directory.hand_over("hall", 2, now_ns_);
  run(4);
  EXPECT_EQ(kind(first_), Kind::elsewhere);
  run(2);
  EXPECT_EQ(kind(first_), Kind::unowned);
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.directory.hand_over("hall", 2, now_ns_);
  second_.directory.drain(now_ns_);
  run(0.5);
  EXPECT_EQ(kind(first_), Kind::unowned) << "nobody is sent to a server that drains";
}

TEST_F(FleetOfTwo, a_room_that_is_claimed_while_it_is_handed_over_is_claimed_again) {
  run(1);
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.directory.hand_over("hall", 2, now_ns_);
  first_.directory.claim("hall", now_ns_);
  run(1);
  EXPECT_EQ(kind(first_), Kind::here);
  first_.directory.release("hall", now_ns_);
  run(1);
  EXPECT_EQ(kind(first_), Kind::unowned);
  EXPECT_EQ(first_.count(FleetEvent::Kind::room_handed_over), 0u);
  first_.directory.hand_over("hall", 2, now_ns_);
  EXPECT_EQ(kind(first_), Kind::unowned) << "it is not its to give";
}

TEST_F(FleetOfTwo, a_room_that_is_claimed_while_it_is_released_is_claimed_again) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.directory.release("hall", now_ns_);
  first_.directory.claim("hall", now_ns_);
  run(0.2);
  EXPECT_EQ(kind(first_), Kind::here);
  EXPECT_EQ(first_.count(FleetEvent::Kind::room_claimed), 2u);
}

TEST_F(FleetOfTwo, a_watch_that_has_died_without_a_word_is_found_soon_where_somebody_waits) {
  for (const bool somebody_waits : {false, true}) {
    first_.directory.claim("hall", now_ns_);
    run(1);
    second_.kill_watch();
    first_.directory.release("hall", now_ns_);
    run(0.2);
    EXPECT_EQ(kind(second_), Kind::elsewhere) << "it has not heard of the release";
    for (int step = 0; step < 25; ++step) {
      if (somebody_waits) second_.directory.look_again(now_ns_);
      run(0.1);
    }
    EXPECT_EQ(kind(second_), somebody_waits ? Kind::unowned : Kind::elsewhere);
    run(20);
    EXPECT_EQ(kind(second_), Kind::unowned);
  }
}

TEST_F(FleetOfTwo, a_watch_that_has_died_without_a_word_is_found_within_two_leases_where_nobody_waits) {
  run(1);
  second_.kill_watch();
  first_.directory.claim("hall", now_ns_);
  run(1);
  EXPECT_EQ(kind(second_), Kind::unowned) << "it has not heard of the claim";
  run(18);
  EXPECT_EQ(kind(second_), Kind::elsewhere);
}

TEST_F(FleetOfTwo, keeps_a_watch_that_has_just_said_something_whoever_waits) {
  run(5);
  const std::uint64_t watches = second_.counters.watches.value();
  for (int step = 0; step < 40; ++step) {
    second_.directory.look_again(now_ns_);
    if (step % 8 == 0) first_.directory.claim("room-" + std::to_string(step), now_ns_);
    run(0.1);
  }
  EXPECT_EQ(second_.counters.watches.value(), watches);
  for (int step = 0; step < 12; ++step) {
    second_.directory.look_again(now_ns_);
    run(0.1);
  }
  EXPECT_EQ(second_.counters.watches.value(), watches + 1) << "it may be dead";
}

TEST_F(FleetOfTwo, refuses_claims_with_wrong_names_beyond_its_bound_and_while_it_drains) {
  EXPECT_FALSE(first_.directory.claim("a/b", now_ns_));
  EXPECT_FALSE(first_.directory.claim(std::string(65, 'a'), now_ns_));
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(first_.directory.claim("room-" + std::to_string(i), now_ns_));
  EXPECT_FALSE(first_.directory.claim("hall", now_ns_));
  run(1);
  EXPECT_EQ(first_.count(FleetEvent::Kind::room_claimed), 100u);
  second_.directory.drain(now_ns_);
  EXPECT_FALSE(second_.directory.claim("hall", now_ns_));
  run(0.1);
  EXPECT_TRUE(first_.directory.servers().at(1).draining) << "the others hear it at once";
  EXPECT_EQ(first_.counters.claims_refused_name.value(), 2u);
  EXPECT_EQ(first_.counters.claims_refused_full.value(), 1u);
  EXPECT_EQ(second_.counters.claims_refused_draining.value(), 1u);
}

TEST_F(FleetOfTwo, a_cut_off_server_stops_before_another_can_have_its_room) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.is_cut = true;
  const std::int64_t cut_ns = now_ns_;
  while (first_.directory.holds("hall", now_ns_)) run(0.02);
  EXPECT_LE(now_ns_ - cut_ns, 9 * kSecond_ns - lease_margin_ns(9 * kSecond_ns));
  EXPECT_EQ(kind(first_), Kind::unavailable);
  while (kind(second_) != Kind::unowned) run(0.02);
  second_.directory.claim("hall", now_ns_);
  run(0.1);
  EXPECT_EQ(kind(second_), Kind::here);
  first_.is_cut = false;
  run(2);
  EXPECT_EQ(first_.count(FleetEvent::Kind::lease_paused), 1u);
  EXPECT_EQ(first_.count(FleetEvent::Kind::room_lost), 1u);
  EXPECT_EQ(kind(first_), Kind::elsewhere);
}

TEST_F(FleetOfTwo, a_server_that_does_not_hear_etcd_leaves_its_rooms_to_others) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.is_deaf = true;
  expect_the_hall_to_move();
  first_.is_deaf = false;
  expect_the_first_to_join_afresh();
}

TEST_F(FleetOfTwo, a_server_that_etcd_answers_too_late_leaves_its_rooms_to_others) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.late_ns = 4 * kSecond_ns;
  expect_the_hall_to_move();
  first_.late_ns = 0;
  expect_the_first_to_join_afresh();
}

TEST_F(FleetOfTwo, a_server_that_hears_etcd_too_late_every_other_time_leaves_its_rooms_to_others) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.is_deaf_to_keep_alives = true;
  expect_the_hall_to_move();
  first_.is_deaf_to_keep_alives = false;
  expect_the_first_to_join_afresh();
}

TEST_F(FleetOfTwo, a_server_that_does_not_hear_etcd_fills_it_with_no_leases) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.is_deaf = true;
  first_.directory.keep("hall", "text", now_ns_);
  run(120);
  EXPECT_LE(etcd_.lease_count(), 8u);
}

TEST_F(FleetOfTwo, a_lost_lease_gives_rooms_back_that_nobody_has_taken) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  etcd_.end_lease_of("/hairnet/test/rooms/hall");
  run(5);
  EXPECT_EQ(kind(first_), Kind::here);
  EXPECT_EQ(first_.counters.leases_lost.value(), 1u);
  EXPECT_EQ(first_.count(FleetEvent::Kind::room_claimed), 2u);
  EXPECT_EQ(first_.count(FleetEvent::Kind::room_lost), 0u);
}

// What a room's new owner has found.
std::string kept_of(const Member& member) {
  std::string kept = "no claim";
  for (const FleetEvent& event : member.events)
    if (event.kind == FleetEvent::Kind::room_claimed) kept = event.kept;
  return kept;
}

TEST_F(FleetOfTwo, what_is_kept_of_a_room_moves_with_it_when_it_is_given_up) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  EXPECT_EQ(kept_of(first_), "");
  first_.directory.keep("hall", "one", now_ns_);
  run(1);
  EXPECT_EQ(etcd_.value("/hairnet/test/kept/hall"), "one");
  first_.directory.keep("hall", "two", now_ns_);
  first_.directory.release("hall", now_ns_);  // with the newest in the same transaction
  run(0.2);
  second_.directory.claim("hall", now_ns_);
  run(1);
  EXPECT_EQ(kind(second_), Kind::here);
  EXPECT_EQ(kept_of(second_), "two");
  second_.directory.keep("hall", "", now_ns_);
  run(1);
  EXPECT_EQ(etcd_.value("/hairnet/test/kept/hall"), "");
  EXPECT_EQ(first_.counters.entries_refused_malformed.value(), 0u) << "the copies do not hold what is kept";
}

TEST_F(FleetOfTwo, what_is_kept_at_the_last_moment_moves_with_the_room) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.directory.keep("hall", "first of all", now_ns_);
  first_.directory.release("hall", now_ns_);
  run(1);
  second_.directory.claim("hall", now_ns_);
  run(1);
  EXPECT_EQ(kept_of(second_), "first of all");
  EXPECT_EQ(first_.directory.room_count(), 0u);
}

TEST_F(FleetOfTwo, what_is_kept_of_a_room_outlives_its_server_and_the_next_one_takes_it_over) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.directory.keep("hall", "text", now_ns_);
  run(1);
  first_.is_cut = true;
  while (kind(second_) != Kind::unowned) run(0.02);
  second_.directory.claim("hall", now_ns_);
  run(1);
  EXPECT_EQ(kept_of(second_), "text");
  first_.directory.keep("hall", "late", now_ns_);
  first_.is_cut = false;
  run(2);
  EXPECT_EQ(kind(first_), Kind::elsewhere);
  EXPECT_EQ(etcd_.value("/hairnet/test/kept/hall"), "text") << "only the owner of a room may write";
}

TEST_F(FleetOfTwo, what_is_kept_is_put_again_when_its_lease_has_vanished) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.directory.keep("hall", "one", now_ns_);
  run(1);
  etcd_.end_lease_of("/hairnet/test/kept/hall");
  EXPECT_EQ(etcd_.value("/hairnet/test/kept/hall"), "");
  first_.directory.keep("hall", "two", now_ns_);
  run(1);
  EXPECT_EQ(etcd_.value("/hairnet/test/kept/hall"), "two");
  EXPECT_EQ(kind(first_), Kind::here) << "the lease of its rooms is another one";
  EXPECT_EQ(first_.counters.leases_lost.value(), 0u);
}

TEST_F(FleetOfTwo, what_is_kept_while_etcd_is_away_is_put_when_it_is_back) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.directory.keep("hall", "before", now_ns_);
  run(1);
  keep_while_etcd_is_away("meanwhile");
  EXPECT_EQ(kind(first_), Kind::here);
  EXPECT_EQ(kept_of(first_), "meanwhile");
  EXPECT_EQ(etcd_.value("/hairnet/test/kept/hall"), "meanwhile");
}

TEST_F(FleetOfTwo, what_is_first_kept_after_a_lost_lease_is_removed_when_nothing_is_kept_any_more) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  keep_while_etcd_is_away("meanwhile");
  EXPECT_EQ(etcd_.value("/hairnet/test/kept/hall"), "meanwhile");
  first_.directory.keep("hall", "", now_ns_);
  first_.directory.release("hall", now_ns_);
  run(1);
  EXPECT_EQ(etcd_.value("/hairnet/test/kept/hall"), "");
}

TEST_F(FleetOfTwo, nobody_is_let_into_a_room_before_what_was_kept_of_it_is_told) {
  run(1);
  first_.directory.claim("hall", now_ns_);
  first_.takes_events = false;
  run(1);
  EXPECT_EQ(kind(first_), Kind::pending);
  first_.takes_events = true;
  run(0.1);
  EXPECT_EQ(kind(first_), Kind::here);
}

TEST_F(FleetOfTwo, rooms_pause_without_etcd_and_go_on_when_it_is_back) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  etcd_.go_down();
  run(20);
  EXPECT_EQ(kind(first_), Kind::unavailable);
  EXPECT_FALSE(first_.directory.is_reachable());
  EXPECT_TRUE(second_.directory.claim("other", now_ns_));
  run(11);
  EXPECT_EQ(second_.events.back().kind, FleetEvent::Kind::claim_failed);
  EXPECT_EQ(second_.counters.claims_refused_unreachable.value(), 1u);
  etcd_.come_up(now_ns_);
  run(3);
  EXPECT_EQ(kind(first_), Kind::here);
  EXPECT_EQ(first_.count(FleetEvent::Kind::room_claimed), 1u) << "etcd has kept the lease";
  EXPECT_EQ(first_.count(FleetEvent::Kind::lease_resumed), 1u);
}

TEST_F(FleetOfTwo, with_go_on_rooms_do_not_stop_while_etcd_is_dead) {
  EtcdDirectoryDef bold = def(3);
  bold.without_etcd = WithoutEtcd::go_on;
  bold.endpoint_count = 3;
  Member third(etcd_, bold);
  third.directory.claim("attic", now_ns_);
  const auto run_third = [&](int steps) {
    bool held = true;
    for (int i = 0; i < steps; ++i, now_ns_ += 20 * kMs) {
      third.step(now_ns_);
      held &= i < 20 || third.directory.holds("attic", now_ns_);
    }
    return held;
  };
  EXPECT_TRUE(run_third(100));
  etcd_.go_down();
  EXPECT_TRUE(run_third(3000)) << "a minute";
  third.is_silent = true;
  EXPECT_TRUE(run_third(3000)) << "no refusals, time-outs only";
  third.is_silent = false;
  etcd_.come_up(now_ns_);
  EXPECT_TRUE(run_third(200));
  EXPECT_GT(third.counters.outages_bridged.value(), 5u);
  EXPECT_EQ(third.counters.leases_lost.value(), 0u);
}

TEST_F(FleetOfTwo, with_go_on_the_rooms_of_a_server_that_does_not_hear_etcd_go_on_and_are_its_own) {
  EtcdDirectoryDef bold = def(3);
  bold.without_etcd = WithoutEtcd::go_on;
  Member third(etcd_, bold);
  third.directory.claim("attic", now_ns_);
  for (int i = 0; i < 3000; ++i, now_ns_ += 20 * kMs) {
    third.is_deaf = i > 50;
    etcd_.advance(now_ns_);
    third.step(now_ns_);
    ASSERT_TRUE(i < 20 || third.directory.holds("attic", now_ns_)) << i;
    ASSERT_TRUE(i < 20 || !etcd_.value("/hairnet/test/rooms/attic").empty()) << i;
  }
}

TEST_F(FleetOfTwo, with_go_on_a_server_that_slept_does_not_go_on) {
  EtcdDirectoryDef bold = def(3);
  bold.without_etcd = WithoutEtcd::go_on;
  Member third(etcd_, bold);
  third.directory.claim("attic", now_ns_);
  for (int i = 0; i < 50; ++i, now_ns_ += 20 * kMs) third.step(now_ns_);
  EXPECT_TRUE(third.directory.holds("attic", now_ns_));
  now_ns_ += 60 * kSecond_ns;  // etcd may have given the room away, and died later
  etcd_.go_down();
  for (int i = 0; i < 500; ++i, now_ns_ += 20 * kMs) {
    third.step(now_ns_);
    ASSERT_FALSE(third.directory.holds("attic", now_ns_));
  }
}

TEST_F(FleetOfTwo, lists_again_after_a_compaction) {
  run(1);
  EXPECT_EQ(second_.counters.lists.value(), 1u);
  second_.is_cut = true;
  run(1);
  first_.directory.claim("hall", now_ns_);
  run(25, false);
  etcd_.compact();
  second_.is_cut = false;
  run(25);
  EXPECT_EQ(second_.counters.lists.value(), 2u);
  EXPECT_EQ(kind(second_), Kind::elsewhere);
}

TEST_F(FleetOfTwo, goes_on_with_an_etcd_that_has_lost_its_data) {
  for (int i = 0; i < 100; ++i) etcd_.put("/hairnet/test/rooms/r" + std::to_string(i), "0000000000000009");
  first_.directory.claim("hall", now_ns_);
  run(2);
  EXPECT_EQ(kind(second_), Kind::elsewhere);
  etcd_.go_down();
  etcd_.lose_data();
  run(20);  // longer than a lease
  etcd_.come_up(now_ns_);
  run(5);
  EXPECT_EQ(kind(first_), Kind::here) << "claimed anew";
  EXPECT_EQ(kind(second_), Kind::elsewhere);
  EXPECT_EQ(second_.directory.where("r1", now_ns_).kind, Kind::unowned);
  first_.directory.release("hall", now_ns_);
  run(1);
  second_.directory.claim("hall", now_ns_);
  run(1);
  EXPECT_EQ(kind(second_), Kind::here);
  EXPECT_EQ(kind(first_), Kind::elsewhere) << "hears of changes again";
}

TEST_F(FleetOfTwo, lists_many_rooms_page_by_page) {
  for (int i = 0; i < 2500; ++i) etcd_.put("/hairnet/test/rooms/r" + std::to_string(i), "0000000000000009");
  run(1);
  EXPECT_EQ(first_.directory.rooms().size(), 2500u);
  EXPECT_EQ(first_.directory.where("r7", now_ns_).kind, Kind::pending) << "its owner is not known";
}

TEST_F(FleetOfTwo, refuses_entries_that_are_not_valid) {
  for (const auto& [key, value] : std::vector<std::pair<std::string, std::string>>{{"rooms/a b", "0000000000000009"},
                                                                                   {"rooms/hall", "nobody"},
                                                                                   {"servers/9", "{}"},
                                                                                   {"servers/0000000000000009", "{}"},
                                                                                   {"rotten", ""}})
    etcd_.put("/hairnet/test/" + key, value);
  run(1);
  EXPECT_EQ(first_.counters.entries_refused_malformed.value(), 5u);
  EXPECT_EQ(first_.directory.servers().size(), 2u);
  EXPECT_TRUE(first_.directory.claim("hall", now_ns_));
  run(0.2);
  EXPECT_EQ(first_.count(FleetEvent::Kind::claim_failed), 1u) << "the key exists, whoever wrote it";
}

TEST_F(FleetOfTwo, skips_values_that_are_too_long_wherever_they_are) {
  const std::string value(etcd::kValueBytesMax + 1, 'x');
  run(1);
  for (const char* key : {"servers/0000000000000009", "servers/0000000000000002", "rooms/attic", "kept/hall"})
    etcd_.put(std::string("/hairnet/test/") + key, value);
  etcd_.put("/hairnet/test/rooms/" + std::string(etcd::kKeyBytesMax, 'k'), "0000000000000009");
  run(2);
  EXPECT_TRUE(first_.directory.claim("hall", now_ns_));
  run(1);
  EXPECT_EQ(kind(first_), Kind::here);
  EXPECT_EQ(kind(second_), Kind::elsewhere) << "and its watch goes on";
  EXPECT_EQ(first_.counters.entries_refused_oversize.value(), 5u);
  EXPECT_EQ(first_.counters.lists.value(), 1u);
  EXPECT_LT(etcd_.value("/hairnet/test/servers/0000000000000002").size(), 1000u) << "a server writes its own again";
  Member third(etcd_, def(3));
  for (int i = 0; i < 50; ++i, now_ns_ += 20 * kMs) third.step(now_ns_);
  EXPECT_EQ(third.directory.where("hall", now_ns_).kind, Kind::elsewhere) << "the list is read";
  EXPECT_EQ(third.directory.servers().size(), 3u);
  EXPECT_TRUE(third.directory.claim("attic", now_ns_));
  for (int i = 0; i < 50; ++i, now_ns_ += 20 * kMs) third.step(now_ns_);
  EXPECT_EQ(third.count(FleetEvent::Kind::claim_failed), 1u) << "the key exists, whoever wrote it";
  etcd_.remove("/hairnet/test/rooms/attic");
  EXPECT_TRUE(third.directory.claim("attic", now_ns_));
  for (int i = 0; i < 50; ++i, now_ns_ += 20 * kMs) third.step(now_ns_);
  EXPECT_TRUE(third.directory.holds("attic", now_ns_));
}

TEST_F(FleetOfTwo, skips_values_that_are_longer_than_an_answer_may_be) {
  first_.answer_bytes_max = second_.answer_bytes_max = 2 * etcd::kValueBytesMax;  // long ones take time
  const std::string value(first_.answer_bytes_max, 'x');
  run(1);
  for (const char* key : {"servers/0000000000000008", "kept/hall", "rooms/attic"})
    etcd_.put(std::string("/hairnet/test/") + key, value);
  for (int i = 0; i < 2500; ++i) etcd_.put("/hairnet/test/rooms/r" + std::to_string(i), "0000000000000009");
  etcd_.put("/hairnet/test/rooms/a", "0000000000000009");
  run(3);
  EXPECT_EQ(first_.directory.rooms().size(), 2501u) << "with the one before the long value";
  EXPECT_EQ(first_.directory.servers().size(), 2u) << "behind the long value";
  EXPECT_TRUE(first_.directory.claim("hall", now_ns_));
  EXPECT_TRUE(first_.directory.claim("attic", now_ns_));
  run(2);
  EXPECT_EQ(kind(first_), Kind::here);
  EXPECT_EQ(first_.count(FleetEvent::Kind::claim_failed), 1u);
  EXPECT_EQ(kind(second_), Kind::elsewhere);
  EXPECT_TRUE(first_.directory.is_reachable());
  for (const char* key : {"servers/0000000000000008", "kept/hall", "rooms/attic"})
    etcd_.remove(std::string("/hairnet/test/") + key);
  EXPECT_TRUE(second_.directory.claim("attic", now_ns_));
  run(2);
  EXPECT_TRUE(second_.directory.holds("attic", now_ns_));
}

TEST_F(FleetOfTwo, malformed_answers_are_counted_and_do_no_harm) {
  first_.directory.claim("hall", now_ns_);
  first_.answers_with = support::SimulatedEtcd::Answer{200, "{\"ID\":7}"};
  run(3);
  EXPECT_GT(first_.counters.requests_failed_malformed.value(), 3u);
  EXPECT_FALSE(first_.directory.holds("hall", now_ns_));
  first_.answers_with = support::SimulatedEtcd::Answer{403, "no"};
  run(3);
  EXPECT_GT(first_.counters.requests_failed_refused.value(), 3u);
  EXPECT_LT(first_.counters.requests.value(), 60u) << "it does not ask without pause";
  first_.answers_with.reset();
  run(2);
  EXPECT_EQ(kind(first_), Kind::here);
}

TEST_F(FleetOfTwo, requests_have_time_outs) {
  first_.is_silent = true;
  run(10);
  EXPECT_GT(first_.counters.requests_failed_timeout.value(), 3u);
  EXPECT_LE(first_.directory.call_count(), 3u);
}

TEST_F(FleetOfTwo, a_server_tells_its_load_at_most_once_a_second) {
  run(1);
  const std::int64_t before = etcd_.revision();
  for (int i = 0; i < 250; ++i) {
    first_.directory.tell({.free_share = 0.5, .characters = static_cast<std::uint32_t>(i)});
    run(0.02);
  }
  EXPECT_LE(etcd_.revision() - before, 6);
  EXPECT_GE(etcd_.revision() - before, 4);
  run(2);
  const std::int64_t quiet = etcd_.revision();
  for (int i = 0; i < 100; ++i) {
    first_.directory.tell({.free_share = 0.5 + 1e-3 * (i % 2), .characters = 249});
    run(0.02);
  }
  EXPECT_EQ(etcd_.revision(), quiet) << "nothing has changed";
}

TEST_F(FleetOfTwo, a_server_that_stops_leaves_nothing) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.directory.stop(now_ns_);
  EXPECT_FALSE(first_.directory.holds("hall", now_ns_));
  EXPECT_FALSE(first_.directory.is_stopped());
  run(0.1);
  EXPECT_TRUE(first_.directory.is_stopped());
  EXPECT_EQ(kind(second_), Kind::unowned);
  EXPECT_EQ(second_.directory.servers().size(), 1u);
}

TEST_F(FleetOfTwo, a_server_that_stops_and_does_not_hear_etcd_leaves_nothing) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  first_.is_deaf = true;
  run(1);
  first_.directory.stop(now_ns_);
  run(1);
  EXPECT_EQ(kind(second_), Kind::unowned);
  EXPECT_EQ(second_.directory.servers().size(), 1u);
}

TEST(LocalDirectory, has_every_room_until_it_stops) {
  LocalDirectory directory(5, {.host = "", .port = 7420, .page = ""});
  EXPECT_EQ(directory.where("hall", 7).kind, Kind::here);
  EXPECT_TRUE(directory.holds("hall", 7));
  EXPECT_TRUE(directory.claim("hall", 7));
  EXPECT_FALSE(directory.claim("a b", 7));
  EXPECT_EQ(directory.servers().size(), 1u);
  directory.drain(8);
  EXPECT_FALSE(directory.claim("hall", 8));
  EXPECT_TRUE(directory.holds("hall", 8));
  directory.stop(9);
  EXPECT_TRUE(directory.is_stopped());
  EXPECT_FALSE(directory.holds("hall", 9));
  EXPECT_EQ(directory.where("hall", 9).kind, Kind::unavailable);
}

}  // namespace
}  // namespace hairnet::server
