#include "server/fleet/etcd_copy.hpp"

#include <gtest/gtest.h>

#include <string>

#include "tests/unit/server/fleet_of_two.hpp"

namespace hairnet::server {
namespace {

// A watch is a stream of changes. When its connection dies silently, the server's copy of the fleet goes stale. With
// somebody waiting, a watch that has been silent for 1 s is begun again (kAwaitedSilence_ns in etcd_copy.cpp); else
// after two leases, 18 s.
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

// The watch brings a change every 0.8 s, less than the 1 s after which it counts as silent.
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

// etcd has dropped the history that the second server missed, so its watch cannot go on from where it was.
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
  // An outage of 20 s is longer than a lease of 9 s.
  run(20);
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

// A page has 1000 entries (kListPage in etcd_copy.cpp), so that it fits in an answer.
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
  FleetMember third(etcd_, def(3));
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
  // An answer may have 4 MiB (kAnswerBytesMax). This bound is smaller, since values of 4 MiB would take much time.
  first_.answer_bytes_max = second_.answer_bytes_max = 2 * etcd::kValueBytesMax;
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
  // Tries are up to 1 s apart (kBackoffMax_ns in etcd_calls.cpp); without pauses there would be one every 20 ms, 300 in
  // 6 s.
  EXPECT_LT(first_.counters.requests.value(), 60u) << "it does not ask without pause";
  first_.answers_with.reset();
  run(2);
  EXPECT_EQ(kind(first_), Kind::here);
}

}  // namespace
}  // namespace hairnet::server
