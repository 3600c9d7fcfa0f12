#include "core/world/character_touch.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/world/character.hpp"
#include "tests/support/levels.hpp"

// Tests what the beginning of a tick makes of a room's bodies and a character's holds. The solver does not run here.
namespace hairnet {
namespace {

constexpr double kTick_s = 1.0 / 30;
constexpr ToucherId kOwner = 5;
constexpr TouchKey kHand{kOwner, 1};
const Vec3 kHead{0, 1.5, 0};

TouchBody ball(const Vec3& place, bool has_jumped = false, TouchKey key = kHand) {
  return {key, sphere(0.03), {Quat::Identity(), place}, has_jumped};
}

Character make_character() {
  auto levels = std::make_shared<LevelSet>();
  levels->levels[0] = support::make_random_level({.contact_count = 60});
  Character c;
  c.levels = levels;
  c.level = LevelIndex::high;
  c.owner = kOwner;
  c.from = c.to = c.last_from = rigid_pose({Quat::Identity(), kHead});
  c.last_step_s = kTick_s;
  reset_to_rest(*c.model(), c.state);
  return c;
}

Vec3 rest_world(const Character& c, std::uint32_t point) {
  return c.to.head().point(c.model()->contacts.rest[point].cast<double>());
}

// Puts a hand at a contact point and lets it take hold of this point alone: the radius of a micrometre reaches no
// other.
RoomBodies hold_one(std::uint32_t point, Character& c) {
  const RoomBodies room = move_bodies({}, std::vector{ball(rest_world(c, point))}, kTick_s);
  EXPECT_EQ(take_hold(room, {kHand, Vec3::Zero(), 1e-6}, c), 1u);
  return room;
}

TEST(RoomBodies, move_from_where_they_were_and_then_stay) {
  const Vec3 shift(0.1, 0, 0);
  RoomBodies room = move_bodies({}, std::vector{ball(kHead)}, kTick_s);
  // A body that is new appears at its place, and does not sweep hair on the way there.
  EXPECT_EQ(room[0].from.position, kHead);
  EXPECT_TRUE(room[0].moves);
  rest_bodies(room);
  EXPECT_FALSE(room[0].moves);
  room = move_bodies(room, std::vector{ball(kHead + shift)}, kTick_s);
  EXPECT_EQ(room[0].from.position, kHead);
  // A second move before the tick replaces the first: the body still starts where it was at the end of the last tick.
  room = move_bodies(room, std::vector{ball(kHead + 2 * shift)}, kTick_s);
  EXPECT_EQ(room[0].from.position, kHead);
  rest_bodies(room);
  EXPECT_EQ(room[0].from.position, kHead + 2 * shift);
  EXPECT_TRUE(move_bodies(room, {}, kTick_s).empty());
}

TEST(RoomBodies, jump_when_they_say_so_or_are_too_fast) {
  RoomBodies room = move_bodies({}, std::vector{ball(kHead)}, kTick_s);
  rest_bodies(room);
  const double farthest_m = kTouchSpeedMax_m_per_s * kTick_s;
  const auto sweeps = [&](const TouchBody& body) {
    const RoomBodies moved = move_bodies(room, std::vector{body}, kTick_s);
    return moved[0].from.position != moved[0].body.place.position;
  };
  EXPECT_TRUE(sweeps(ball(kHead + Vec3(0.1, 0, 0))));
  EXPECT_FALSE(sweeps(ball(kHead + Vec3(0.1, 0, 0), true)));
  EXPECT_TRUE(sweeps(ball(kHead + Vec3(0, 0.99 * farthest_m, 0))));
  EXPECT_FALSE(sweeps(ball(kHead + Vec3(0, 1.01 * farthest_m, 0))));
  // The middle moves slowly enough, but the capsule's ends turn by 1 rad in a tick, 30 cm from the middle, that is
  // faster than kTouchSpeedMax_m_per_s = 8.
  TouchBody spinning = ball(kHead + Vec3(0, 0.1, 0));
  spinning.shape = capsule(0.3, 0.01);
  spinning.place.rotation = Quat(Eigen::AngleAxisd(1, Vec3::UnitX()));
  EXPECT_FALSE(sweeps(spinning));
}

TEST(CharacterTouch, is_absent_where_nothing_is_near) {
  Character c = make_character();
  meet_bodies({}, kTick_s, c);
  EXPECT_FALSE(c.touch);
  meet_bodies(move_bodies({}, std::vector{ball(kHead + Vec3(2, 0, 0))}, kTick_s), kTick_s, c);
  EXPECT_FALSE(c.touch);
  meet_bodies(move_bodies({}, std::vector{ball(kHead)}, kTick_s), kTick_s, c);
  EXPECT_TRUE(c.touch);
  meet_bodies({}, kTick_s, c);
  EXPECT_FALSE(c.touch);
}

// Each toucher has two bodies at the head: number 7 touches only hair of its own person (`only_own`), number 1 whatever
// the rule allows. The last rule names the room, the owner, one toucher twice, and touchers who are not there.
TEST(CharacterTouch, exactly_the_bodies_are_met_that_may_touch_and_the_others_of_the_room_counted) {
  std::vector<TouchBody> bodies;
  for (const ToucherId toucher : {kRoomToucher, ToucherId{3}, ToucherId{4}, kOwner, ToucherId{9}}) {
    for (const std::uint8_t number : {std::uint8_t{1}, std::uint8_t{7}}) {
      bodies.push_back(ball(kHead, false, {toucher, number}));
      bodies.back().only_own = toucher != kRoomToucher && number == 7;
    }
  }
  const RoomBodies room = move_bodies({}, bodies, kTick_s);
  using enum TouchAudience;
  for (const TouchRule& rule : {TouchRule{nobody}, TouchRule{oneself}, TouchRule{everyone}, TouchRule{chosen},
                                TouchRule{chosen, {3, 9}}, TouchRule{chosen, {kRoomToucher, 1, 4, 4, kOwner, 20}}}) {
    Character c = make_character();
    c.touch_rule = rule;
    std::vector<TouchKey> allowed, met;
    for (const TouchBody& body : bodies) {
      if (may_touch(rule, kOwner, body)) allowed.push_back(body.key);
    }
    const TouchCounts counts = meet_bodies(room, kTick_s, c);
    ASSERT_TRUE(c.touch);
    for (const CharacterTouch::MetBody& body : c.touch->bodies) met.push_back(body.key);
    EXPECT_EQ(met, allowed);
    EXPECT_EQ(counts.bodies_refused, bodies.size() - allowed.size());
  }
}

// The body is 2 m away at the start of the tick and at its end, and passes through the hair in between. The tick lasts
// 1 s, so that 4 m/s do not count as a jump.
TEST(CharacterTouch, a_body_that_passes_within_the_tick_is_met) {
  Character c = make_character();
  RoomBodies room = move_bodies({}, std::vector{ball(kHead + Vec3(-2, 0, 0))}, 1.0);
  rest_bodies(room);
  room = move_bodies(room, std::vector{ball(kHead + Vec3(2, 0, 0))}, 1.0);
  meet_bodies(room, 1.0, c);
  ASSERT_TRUE(c.touch);
  EXPECT_EQ(c.touch->bodies.size(), 1u);
}

// The ball keeps hair inside it, like the walls of a room. Hair reaches some 20 cm, so a wall 5 m away does not matter
// and one at 15 cm does.
TEST(CharacterTouch, a_room_inside_out_is_met_only_near_its_wall) {
  Character c = make_character();
  const auto is_met = [&](double radius_m) {
    TouchBody room = ball(kHead);
    room.shape = {.radius_m = radius_m, .is_inside_out = true};
    meet_bodies(move_bodies({}, std::vector{room}, kTick_s), kTick_s, c);
    return c.touch != nullptr;
  };
  EXPECT_FALSE(is_met(5));
  EXPECT_TRUE(is_met(0.15));
}

// A tracked hand may reach into the skull, where it would push hair from inside. Hands must be moved out to within a
// few millimetres; props are fixed to the room and stay.
TEST(CharacterTouch, hands_are_pushed_out_of_the_skin_and_props_are_not) {
  Character c = make_character();
  c.from = c.to = rigid_pose(support::turned(0.7, {0, 1, 0}, kHead));
  const SkinDistanceField& skull = c.model()->skin->front();
  const auto depth_m = [&](const TouchBody& body) {
    meet_bodies(move_bodies({}, std::vector{body}, kTick_s), kTick_s, c);
    const StepBody& met = c.touch->bodies.at(0).body;
    EXPECT_EQ(met.from.position, met.to.position);
    double deepest_m = 0;
    for (const double at : {-1.0, 0.0, 1.0}) {
      const Vec3 centre = c.to.head().inverse().point(met.to.point(at * met.shape.half_size_m));
      deepest_m = std::max(deepest_m, met.shape.radius_m - skin_distance(skull, centre));
    }
    return deepest_m;
  };
  // A ball is moved out along one normal, which leaves less than 2 mm. For a capsule only the deepest of three places
  // counts, so 4 mm may remain. The prop stays more than 2 cm deep.
  EXPECT_LT(depth_m(ball(kHead + Vec3(0.02, 0.07, 0.01))), 0.002);
  TouchBody finger = ball(kHead + Vec3(0.08, 0.05, 0));
  finger.shape = capsule(0.04, 0.01);
  EXPECT_LT(depth_m(finger), 0.004);
  EXPECT_GT(depth_m(ball(kHead + Vec3(0.02, 0.07, 0.01), false, {kRoomToucher, 1})), 0.02);
}

// A turn of two steps must move the body and the held point by half of the way in each, or the first step would tear at
// the hair.
TEST(CharacterTouch, steps_share_the_way_of_bodies_and_anchors) {
  Character c = make_character();
  RoomBodies room = hold_one(7, c);
  rest_bodies(room);
  const Vec3 way(0, 0.003, 0.12), begin = rest_world(c, 7);
  room = move_bodies(room, std::vector{ball(begin + way, false)}, kTick_s);
  meet_bodies(room, kTick_s, c);
  std::vector<StepInput> inputs(2);
  for (StepInput& input : inputs) input.from = input.to = c.to;
  put_touch(c, inputs);
  for (int s = 0; s < 2; ++s) {
    ASSERT_TRUE(inputs[s].touch);
    const StepHold& hold = inputs[s].touch->holds[0];
    EXPECT_EQ(hold.point, 7u);
    EXPECT_LT((hold.from - begin - 0.5 * s * way).norm(), 1e-9);
    EXPECT_LT((hold.to - begin - 0.5 * (s + 1) * way).norm(), 1e-9);
    const StepBody& body = inputs[s].touch->bodies[0];
    EXPECT_LT((body.to.position - body.from.position - 0.5 * way).norm(), 1e-9);
    EXPECT_EQ(body.friction, kTouchFriction);
  }
}

TEST(CharacterTouch, a_held_point_pulls_no_harder_than_it_slips) {
  Character c = make_character();
  RoomBodies room = hold_one(7, c);
  rest_bodies(room);
  const Vec3 way(0.04, 0, 0.03);
  room = move_bodies(room, std::vector{ball(rest_world(c, 7) + way)}, kTick_s);
  meet_bodies(room, kTick_s, c);
  // The hand has moved by 5 cm and the hair has not: the spring of the hold would pull with 5 N (kHoldStiffness_n_per_m
  // = 100). The anchor must slide until the pull is kHoldSlip_n = 0.5 N, in the same direction.
  slip_holds(c);
  const Vec3 anchor = c.touch->hands[0].to.point(c.touch->holds.at(0).anchor);
  const Vec3 pull_N = kHoldStiffness_n_per_m * (anchor - rest_world(c, 7));
  EXPECT_NEAR(pull_N.norm(), kHoldSlip_n, 1e-9);
  EXPECT_NEAR(pull_N.normalized().dot(way.normalized()), 1, 1e-9);
  const Vec3 before = c.touch->holds[0].anchor;
  slip_holds(c);
  EXPECT_LT((c.touch->holds[0].anchor - before).norm(), 1e-12);
}

TEST(CharacterTouch, a_point_that_is_stretched_too_far_is_lost) {
  for (const double way_m : {0.9 * kHoldStretchMax_m, 1.1 * kHoldStretchMax_m}) {
    Character c = make_character();
    RoomBodies room = hold_one(7, c);
    rest_bodies(room);
    room = move_bodies(room, std::vector{ball(rest_world(c, 7) + Vec3(0, 0, way_m))}, 1.0);
    EXPECT_EQ(meet_bodies(room, 1.0, c).holds_ended, 0u);
    slip_holds(c);
    const bool is_lost = way_m > kHoldStretchMax_m;
    EXPECT_EQ(c.touch->holds.empty(), is_lost);
    EXPECT_EQ(c.touch->holds_stretched, is_lost ? 1u : 0u);
  }
}

TEST(CharacterTouch, a_hand_that_jumps_away_loses_hair_before_the_step) {
  Character c = make_character();
  RoomBodies room = hold_one(7, c);
  rest_bodies(room);
  room = move_bodies(room, std::vector{ball(rest_world(c, 7) + Vec3(0, 0, 0.4), true)}, kTick_s);
  EXPECT_EQ(meet_bodies(room, kTick_s, c).holds_ended, 1u);
}

TEST(CharacterTouch, a_pin_pulls_nothing_at_first_and_its_hand_can_take_it_again) {
  Character c = make_character();
  const RoomBodies room = hold_one(7, c);
  let_go(kHand, Release::pin, c);
  ASSERT_EQ(c.touch->holds.size(), 1u);
  EXPECT_TRUE(c.touch->holds[0].is_pinned);
  EXPECT_LT((c.to.head().point(c.touch->holds[0].anchor) - rest_world(c, 7)).norm(), 1e-6);
  let_go({kOwner + 1, 1}, Release::unpin, c);
  EXPECT_EQ(c.touch->holds.size(), 1u);
  EXPECT_EQ(take_hold(room, {kHand, Vec3::Zero(), 1e-6}, c), 1u);
  ASSERT_EQ(c.touch->holds.size(), 1u);
  EXPECT_FALSE(c.touch->holds[0].is_pinned);
}

}  // namespace
}  // namespace hairnet
