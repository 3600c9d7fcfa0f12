#include "server/app/largest_room.hpp"

#include <gtest/gtest.h>

namespace hairnet::server {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

RoomLoad load_of(std::size_t room_characters, std::size_t characters, double wanted_s, bool is_over = false) {
  return {.room = "hall",
          .room_characters = room_characters,
          .characters = characters,
          .wanted_s = wanted_s,
          .available_s = 1,
          .is_over = is_over};
}

// A tick wants 0.9 of its time, and the room has this part of the characters. A room that needs the server keeps its
// need until it wants less than 0.8 of the share of 0.5 (kFallsBelow in largest_room.cpp): 0.4.
TEST(LargestRoomOfServer, needs_the_server_alone_when_it_wants_more_than_its_share) {
  LargestRoom room(0.5);
  room.observe(load_of(50, 100, 0.9), 1);
  EXPECT_FALSE(room.needs_own_server()) << "0.45 of the server";
  room.observe(load_of(60, 100, 0.9), 2);
  EXPECT_TRUE(room.needs_own_server()) << "0.54";
  room.observe(load_of(50, 100, 0.9), 3);
  EXPECT_TRUE(room.needs_own_server()) << "0.45 is not far enough below";
  room.observe(load_of(40, 100, 0.9), 4);
  EXPECT_FALSE(room.needs_own_server()) << "0.36";
  room.observe({}, 5);
  EXPECT_FALSE(room.needs_own_server());
}

TEST(LargestRoomOfServer, that_is_not_measured_needs_nothing) {
  LargestRoom room(0.5);
  RoomLoad load = load_of(100, 100, 50, true);
  load.available_s = 0;
  room.observe(load, 1);
  EXPECT_FALSE(room.needs_own_server());
  EXPECT_EQ(room.overloaded(), "");
}

// A room takes clients again when the server has not been over for 5 s (kFitsAfter_ns).
TEST(LargestRoomOfServer, overloads_it_when_not_even_the_coarsest_levels_fit_and_fits_again_after_a_while) {
  LargestRoom room(0.5);
  room.observe(load_of(90, 100, 3), kSecond);
  EXPECT_EQ(room.overloaded(), "") << "coarser levels fit";
  room.observe(load_of(90, 100, 3, true), 2 * kSecond);
  EXPECT_EQ(room.overloaded(), "hall");
  room.observe(load_of(90, 100, 3), 4 * kSecond);
  EXPECT_EQ(room.overloaded(), "hall") << "it is over now and then";
  room.observe(load_of(90, 100, 3, true), 5 * kSecond);
  room.observe(load_of(90, 100, 3), 9 * kSecond);
  EXPECT_EQ(room.overloaded(), "hall");
  room.observe(load_of(90, 100, 3), 10 * kSecond);
  EXPECT_EQ(room.overloaded(), "");
}

TEST(LargestRoomOfServer, is_none_where_many_rooms_fill_the_server) {
  LargestRoom room(0.5);
  room.observe(load_of(30, 100, 9, true), kSecond);
  EXPECT_TRUE(room.needs_own_server()) << "it would take a server of its own, and more";
  EXPECT_EQ(room.overloaded(), "");
}

}  // namespace
}  // namespace hairnet::server
