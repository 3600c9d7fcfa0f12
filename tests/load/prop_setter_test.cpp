#include "tests/load/prop_setter.hpp"

#include <gmock/gmock.h>

#include <algorithm>

#include "client/assets/made/bust_shape.hpp"
#include "tests/load/sent_props.hpp"

namespace hairnet::load {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::int64_t kSecond_ns = 1'000'000'000;

// Ball 5 at a height, as a client sets it and as a server announces it.
wire::SetProps set_at(double height_m) {
  return {{{5, sphere(0.1), {Quat::Identity(), {0, height_m, 0}}}}};
}
wire::RoomProps announced_at(double height_m) {
  // The wire rounds places to float.
  return {{{5, sphere(0.1), {Quat::Identity(), {0, static_cast<float>(height_m), 0}}}}};
}

TEST(PropSetter, sets_moves_and_removes_a_valid_prop) {
  PropSetter setter(0, 7);
  const Vec3 head(3, 1.6, -2);
  bool is_there = false;
  int set = 0, moved = 0, removed = 0;
  // There are two cycles of 6 s.
  for (int pose = 0; pose < 12 * 30; ++pose) {
    const auto change = setter.move(pose * kSecond_ns / 30, head);
    if (!change) continue;
    ASSERT_EQ(change->props.size() + change->removed.size(), 1u);
    if (change->props.empty()) {
      EXPECT_TRUE(is_there);
      EXPECT_EQ(change->removed.front(), 7);
      is_there = false;
      ++removed;
      continue;
    }
    const wire::Prop& prop = change->props.front();
    EXPECT_EQ(wire::validate(prop), "");
    EXPECT_EQ(prop.number, 7);
    // A prop that appears has not moved there, and sweeps no hair along.
    EXPECT_EQ(prop.has_jumped, !is_there);
    ++(is_there ? moved : set);
    is_there = true;
  }
  // In each cycle it moves for 2 s of 30 poses, the first of which sets it.
  EXPECT_EQ(set, 2);
  EXPECT_EQ(moved, 2 * 59);
  EXPECT_EQ(removed, 2);
}

TEST(PropSetter, prop_comes_into_the_hair_and_not_into_the_skin) {
  const Vec3 head(3, 1.6, -2);
  for (std::uint32_t client = 0; client < 20; ++client) {
    PropSetter setter(client, 7);
    double nearest_m = 1;
    for (int pose = 0; pose < 6 * 30; ++pose) {
      const auto change = setter.move(pose * kSecond_ns / 30, head);
      if (!change || change->props.empty()) continue;
      const wire::Prop& prop = change->props.front();
      const Vec3 in_head = prop.place.position - head;
      nearest_m = std::min(nearest_m, in_head.norm() - prop.shape.radius_m);
      // The ball's middle is not in the skin of a bust that stands straight, and most of the ball is in the hair.
      EXPECT_GT(made::bust_distance(in_head), 0.6 * prop.shape.radius_m) << client;
    }
    // Hands stroke hair 14 cm from the head joint (toucher.cpp).
    EXPECT_LT(nearest_m, 0.14) << client;
  }
}

TEST(PropSetter, sets_its_prop_anew_in_a_new_session) {
  PropSetter setter(0, 7);
  ASSERT_TRUE(setter.move(0, Vec3::Zero()));
  setter.begin();
  // The new session's room has no prop that could be removed at 4 s.
  EXPECT_FALSE(setter.move(5 * kSecond_ns, Vec3::Zero()));
  const auto again = setter.move(6 * kSecond_ns, Vec3::Zero());
  ASSERT_TRUE(again);
  ASSERT_EQ(again->props.size(), 1u);
  EXPECT_TRUE(again->props.front().has_jumped);
}

TEST(SentProps, are_shown_once_to_each_other_client_of_the_room) {
  SentProps sent;
  SentProps::Seen seen, seen_by_sender, seen_elsewhere;
  sent.add(0, 1, 10, set_at(0.1));
  EXPECT_THAT(sent.show(0, 2, announced_at(0.1), seen), ElementsAre(10));
  EXPECT_THAT(sent.show(0, 2, announced_at(0.1), seen), IsEmpty());
  EXPECT_THAT(sent.show(0, 1, announced_at(0.1), seen_by_sender), IsEmpty());
  EXPECT_THAT(sent.show(1, 2, announced_at(0.1), seen_elsewhere), IsEmpty());
  sent.add(0, 1, 20, {{}, {5}});
  EXPECT_THAT(sent.show(0, 2, {{}, {5}}, seen), ElementsAre(20));
  EXPECT_THAT(sent.show(0, 1, {{}, {5}}, seen_by_sender), IsEmpty());
}

// A server announces the newest of several changes in one tick. If the others were left out, the longest waits would
// be.
TEST(SentProps, replaced_changes_are_shown_by_the_one_that_replaced_them) {
  SentProps sent;
  SentProps::Seen seen;
  for (const std::int64_t at_ns : {10, 20, 30}) sent.add(0, 1, at_ns, set_at(0.01 * static_cast<double>(at_ns)));
  EXPECT_THAT(sent.show(0, 2, announced_at(0.2), seen), ElementsAre(10, 20));
  EXPECT_THAT(sent.show(0, 2, announced_at(0.3), seen), ElementsAre(30));
  // Somebody else's change at the same number is none of these.
  EXPECT_THAT(sent.show(0, 2, announced_at(7), seen), IsEmpty());
}

TEST(SentProps, earlier_changes_do_not_count_for_a_client_that_comes) {
  SentProps sent;
  sent.add(0, 1, 10, set_at(0.1));
  SentProps::Seen seen = sent.until_now(0);
  wire::RoomProps all = announced_at(0.1);
  all.all = true;
  EXPECT_THAT(sent.show(0, 2, all, seen), IsEmpty());
  sent.add(0, 1, 20, set_at(0.2));
  EXPECT_THAT(sent.show(0, 2, announced_at(0.2), seen), ElementsAre(20));
}

TEST(SentProps, forget_old_changes_and_still_know_new_ones) {
  SentProps sent;
  SentProps::Seen seen;
  for (int i = 0; i < 5000; ++i) sent.add(0, 1, i, set_at(0.001 * i));
  EXPECT_THAT(sent.show(0, 2, announced_at(0), seen), IsEmpty());
  EXPECT_LE(sent.show(0, 2, announced_at(0.001 * 4998), seen).size(), 1024u);
  EXPECT_THAT(sent.show(0, 2, announced_at(0.001 * 4999), seen), ElementsAre(4999));
}

}  // namespace
}  // namespace hairnet::load
