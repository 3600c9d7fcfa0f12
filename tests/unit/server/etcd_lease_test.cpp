#include "server/fleet/etcd_lease.hpp"

#include <gtest/gtest.h>

#include <string>

#include "tests/unit/server/fleet_of_two.hpp"

namespace hairnet::server {
namespace {

// A lease lasts 9 s. The server must stop lease_margin_ns() earlier, since clocks differ in speed and a frame takes
// time to leave.
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

// Requests reach etcd, and answers are lost. If the server went on with keep-alives, no other server could take its
// rooms, which it does not run.
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
  // A request fails after 2 s at most (kRequestTimeoutMax_ns in etcd_calls.cpp), so an answer after 4 s comes too late.
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
  // In two minutes the server tries many times to get a lease. Each granted lease whose answer is lost stays at etcd
  // until it expires.
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

TEST_F(FleetOfTwo, rooms_pause_without_etcd_and_go_on_when_it_is_back) {
  first_.directory.claim("hall", now_ns_);
  run(1);
  etcd_.go_down();
  run(20);
  EXPECT_EQ(kind(first_), Kind::unavailable);
  EXPECT_FALSE(first_.directory.is_reachable());
  // A claim waits 10 s for etcd (kClaimPatience_ns in etcd_rooms.cpp).
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
  FleetMember third(etcd_, bold);
  third.directory.claim("attic", now_ns_);
  // Returns true when the third server has its room in every step.
  const auto run_third = [&](int steps) {
    bool held = true;
    for (int i = 0; i < steps; ++i, now_ns_ += 20 * kMs) {
      third.step(now_ns_);
      held &= third.directory.holds("attic", now_ns_);
    }
    return held;
  };
  // It gets its lease and claims the room in the first steps.
  run_third(20);
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

// With go_on, a server that does not hear etcd runs its rooms on. Its keep-alives still arrive, so etcd must have its
// key throughout, and no other server can claim the room.
TEST_F(FleetOfTwo, with_go_on_the_rooms_of_a_server_that_does_not_hear_etcd_go_on_and_are_its_own) {
  EtcdDirectoryDef bold = def(3);
  bold.without_etcd = WithoutEtcd::go_on;
  FleetMember third(etcd_, bold);
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
  FleetMember third(etcd_, bold);
  third.directory.claim("attic", now_ns_);
  for (int i = 0; i < 50; ++i, now_ns_ += 20 * kMs) third.step(now_ns_);
  EXPECT_TRUE(third.directory.holds("attic", now_ns_));
  // The process was suspended for a minute. Meanwhile etcd may have given the room away and died, so nothing tells
  // whose the room is.
  now_ns_ += 60 * kSecond_ns;
  etcd_.go_down();
  for (int i = 0; i < 500; ++i, now_ns_ += 20 * kMs) {
    third.step(now_ns_);
    ASSERT_FALSE(third.directory.holds("attic", now_ns_));
  }
}

}  // namespace
}  // namespace hairnet::server
