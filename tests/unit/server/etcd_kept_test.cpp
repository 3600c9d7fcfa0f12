#include "server/fleet/etcd_kept.hpp"

#include <gtest/gtest.h>

#include <string>

#include "tests/unit/server/fleet_of_two.hpp"

namespace hairnet::server {
namespace {

// Returns the text of the room that the member found at its last claim: what an earlier owner has kept there for the
// next one.
std::string kept_of(const FleetMember& member) {
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
  // The release and the newest text go to etcd in one transaction, so the next owner cannot find the older text.
  first_.directory.release("hall", now_ns_);
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
  // The first server loses its line to etcd, so its lease ends and the room becomes free.
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

// The server sets up the room when it takes the event of the claim. A client that enters earlier would find an empty
// room.
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

}  // namespace
}  // namespace hairnet::server
