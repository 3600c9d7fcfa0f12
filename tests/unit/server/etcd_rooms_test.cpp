#include "server/fleet/etcd_rooms.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/unit/server/fleet_of_two.hpp"

namespace hairnet::server {
namespace {

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
  // The loser of the race learns who has the room, so it can send its clients there.
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
  // The watch is late: etcd has executed the release, and the server's copy does not show it yet.
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
  // A server names at most 64 grooms (kPassedGroomsMax).
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
  // The next owner has 5 s to claim the room (kHandOver_ns in etcd_rooms.cpp).
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

TEST_F(FleetOfTwo, refuses_claims_with_wrong_names_beyond_its_bound_and_while_it_drains) {
  EXPECT_FALSE(first_.directory.claim("a/b", now_ns_));
  // A name has at most 64 bytes (kRoomNameBytesMax), and a server of this test has at most 100 rooms.
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

}  // namespace
}  // namespace hairnet::server
