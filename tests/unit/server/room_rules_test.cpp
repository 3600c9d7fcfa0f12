#include "server/session/room_rules.hpp"

#include <gtest/gtest.h>

namespace hairnet::server {
namespace {

// A bound on all entries that these tests do not reach. Times are in nanoseconds from any begin, since RoomRules only
// compares them.
constexpr std::size_t kMany = 100;

// A ban until 100 ns holds at 99 ns, and no longer at 100 ns. The name without its last letter is another subject.
TEST(RoomRules, a_ban_is_of_one_subject_in_one_room_and_ends_in_time) {
  RoomRules rules;
  EXPECT_FALSE(rules.is_banned("hall", "sub:mallory", 0));
  ASSERT_TRUE(rules.ban("hall", "sub:mallory", 100, 0, kMany));
  EXPECT_TRUE(rules.is_banned("hall", "sub:mallory", 99));
  EXPECT_FALSE(rules.is_banned("hall", "sub:mallory", 100));
  EXPECT_FALSE(rules.is_banned("attic", "sub:mallory", 0));
  EXPECT_FALSE(rules.is_banned("hall", "sub:mallor", 0));
  EXPECT_FALSE(rules.is_muted("hall", "sub:mallory"));
  rules.expire(99);
  EXPECT_EQ(rules.entry_count(), 1u);
  rules.expire(100);
  EXPECT_EQ(rules.entry_count(), 0u);
}

// At most one entry is allowed, so a second one for the same ban would be refused.
TEST(RoomRules, a_newer_ban_replaces_an_earlier_one) {
  RoomRules rules;
  ASSERT_TRUE(rules.ban("hall", "sub:mallory", 100, 0, 1));
  ASSERT_TRUE(rules.ban("hall", "sub:mallory", 50, 0, 1)) << "needs no further entry";
  EXPECT_FALSE(rules.is_banned("hall", "sub:mallory", 60));
  ASSERT_TRUE(rules.ban("hall", "sub:mallory", 10, 10, 1));
  EXPECT_EQ(rules.entry_count(), 0u) << "a ban without time ends the earlier one";
}

// The last argument is the most entries of all kinds, which is three. Without it moderators could fill the server's
// memory.
TEST(RoomRules, bans_mutes_and_locks_are_bounded_together) {
  RoomRules rules;
  ASSERT_TRUE(rules.ban("hall", "sub:a", 100, 0, 3));
  ASSERT_TRUE(rules.mute("hall", "sub:b", 3));
  ASSERT_TRUE(rules.lock("hall", 3));
  EXPECT_FALSE(rules.ban("hall", "sub:c", 100, 0, 3));
  EXPECT_FALSE(rules.mute("hall", "sub:c", 3));
  EXPECT_FALSE(rules.lock("attic", 3));
  EXPECT_FALSE(rules.is_banned("hall", "sub:c", 0) || rules.is_muted("hall", "sub:c") || rules.is_locked("attic"));
  EXPECT_TRUE(rules.mute("hall", "sub:b", 3)) << "is muted already";
  EXPECT_TRUE(rules.lock("hall", 3)) << "is locked already";
  EXPECT_EQ(rules.entry_count(), 3u);
  EXPECT_TRUE(rules.ban("hall", "sub:c", 200, 100, 3)) << "an ended ban gives way";
  rules.unmute("hall", "sub:b");
  rules.unlock("hall");
  EXPECT_EQ(rules.entry_count(), 1u);
}

// All have left the hall, which still exists until 100 ns. A banned user must not come back by waiting for the room to
// end.
TEST(RoomRules, mutes_and_locks_end_with_their_room_and_bans_do_not) {
  RoomRules rules;
  for (const char* room : {"hall", "attic"}) {
    ASSERT_TRUE(rules.mute(room, "sub:a", kMany));
    ASSERT_TRUE(rules.lock(room, kMany));
  }
  ASSERT_TRUE(rules.mute("hall", "sub:b", kMany));
  ASSERT_TRUE(rules.ban("hall", "sub:c", 1000, 0, kMany));
  rules.close_room("hall", 100);
  rules.expire(99);
  EXPECT_TRUE(rules.is_muted("hall", "sub:a") && rules.is_locked("hall"));
  rules.expire(100);
  EXPECT_FALSE(rules.is_muted("hall", "sub:a") || rules.is_muted("hall", "sub:b") || rules.is_locked("hall"));
  EXPECT_TRUE(rules.is_muted("attic", "sub:a") && rules.is_locked("attic"));
  EXPECT_TRUE(rules.is_banned("hall", "sub:c", 100));
  EXPECT_EQ(rules.entry_count(), 3u);
}

TEST(RoomRules, a_room_that_is_entered_again_in_time_goes_on) {
  RoomRules rules;
  ASSERT_TRUE(rules.mute("hall", "sub:a", kMany));
  rules.close_room("hall", 100);
  rules.open_room("hall");
  rules.expire(100);
  EXPECT_TRUE(rules.is_muted("hall", "sub:a"));
}

}  // namespace
}  // namespace hairnet::server
