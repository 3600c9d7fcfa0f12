#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <random>
#include <vector>

#include "core/world/simulation.hpp"
#include "core/world/world.hpp"
#include "tests/support/contact_places.hpp"
#include "tests/support/learnt.hpp"
#include "tests/support/levels.hpp"

// Tests what hands and props do to hair over seconds, in a whole World. The step alone is in touch_step_test.cpp, and
// the choice of bodies in character_touch_test.cpp.
namespace hairnet {
namespace {

constexpr ToucherId kOwner = 5, kStranger = 9;
constexpr TouchKey kHand{kOwner, 1}, kProp{kRoomToucher, 1};
const Vec3 kHead{0, 1.5, 0};
// The place is among the contact points, in front of the face.
const Vec3 kInHair = kHead + Vec3(0, -0.07, 0.11);

// Makes four levels with many contact points and springs a tenth as stiff as usual in tests, so that a hand moves the
// hair by centimetres.
std::shared_ptr<const LevelSet> make_levels() {
  auto levels = std::make_shared<LevelSet>();
  for (std::size_t i = 0; i < 4; ++i) {
    levels->levels[i] = support::make_random_level({.nodes_per_axis = 6 - static_cast<int>(i),
                                                    .spring_stiffness = 0.2f,
                                                    .attachment_stiffness = 0.5f,
                                                    .contact_count = 300});
  }
  levels->learnt = std::make_shared<LearntHair>(support::random_learnt_hair(3));
  return levels;
}

TouchBody ball(const Vec3& place, TouchKey key = kHand, double radius_m = 0.04) {
  return {key, sphere(radius_m), {Quat::Identity(), place}};
}

// One character, which belongs to kOwner, in a room of its own. A tick is 1/30 s.
struct Scene {
  explicit Scene(LevelIndex level = LevelIndex::medium, const WorldDef& def = {}) : world(def) {
    static const auto levels = make_levels();
    id = world.add({levels, level, pose, 0, kOwner});
  }
  void put(const std::vector<TouchBody>& bodies) { world.set_bodies(0, bodies); }
  StepReport step() { return last = world.step(); }
  void pass(double time_s) {
    for (int tick = 0; tick < std::lround(30 * time_s); ++tick) step();
  }
  // The hand moves evenly from one place to another.
  void move(const Vec3& from, const Vec3& to, double time_s) {
    const auto ticks = std::lround(30 * time_s);
    for (int tick = 1; tick <= ticks; ++tick) {
      put({ball(from + (to - from) * tick / static_cast<double>(ticks))});
      step();
    }
  }
  [[nodiscard]] std::vector<Vec3> points() const { return support::contact_places(world.lattice(id)); }
  [[nodiscard]] bool is_finite() const {
    const LatticeState& state = world.state(id);
    const auto finite = [](const Vec3f& v) { return v.allFinite(); };
    return std::ranges::all_of(state.displacement, finite) && std::ranges::all_of(state.velocity, finite);
  }
  [[nodiscard]] std::vector<Vec3f> displacement() const { return world.state(id).displacement; }

  Pose pose = rigid_pose({Quat::Identity(), kHead});
  World world;
  CharacterId id;
  StepReport last;
};

// Returns the RMS distance of two sets of displacements; all nodes count alike.
double rms_m(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += static_cast<double>((a[i] - b[i]).squaredNorm());
  return std::sqrt(sum / static_cast<double>(a.size()));
}

// Returns the mean movement of the points that were within 5 cm of a place before.
Vec3 mean_way(const std::vector<Vec3>& before, const std::vector<Vec3>& after, const Vec3& place) {
  Vec3 sum = Vec3::Zero();
  int count = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if ((before[i] - place).norm() > 0.05) continue;
    sum += after[i] - before[i];
    ++count;
  }
  return sum / std::max(count, 1);
}

// A stranger's hand passes through the hair for two seconds. By default only the owner may touch, so every bit must
// stay as in a world without the hand; after a change of the rule the same hand must have an effect.
TEST(WorldTouch, who_may_not_touch_changes_nothing) {
  Scene touched, alone;
  for (int tick = 0; tick < 60; ++tick) {
    touched.put({ball(kInHair + Vec3(0.01 * tick - 0.3, 0, 0), {kStranger, 1})});
    EXPECT_EQ(touched.step().bodies_refused, 1u);
    alone.step();
    EXPECT_EQ(touched.last.touched, 0u);
    EXPECT_EQ(touched.world.grab(touched.id, {{kStranger, 1}, Vec3::Zero(), 0.1}), 0u);
  }
  EXPECT_EQ(touched.displacement(), alone.displacement());
  EXPECT_EQ(touched.world.state(touched.id).velocity, alone.world.state(alone.id).velocity);
  touched.world.set_touch_rule(touched.id, {TouchAudience::chosen, {kStranger}});
  touched.put({ball(kInHair, {kStranger, 1})});
  EXPECT_EQ(touched.step().touched, 1u);
  EXPECT_NE(touched.displacement(), alone.displacement());
}

TEST(WorldTouch, what_is_far_away_or_in_another_room_changes_nothing) {
  Scene scene, alone;
  for (int tick = 0; tick < 60; ++tick) {
    scene.put({ball(kHead + Vec3(3, 0.01 * tick, 0))});
    scene.world.set_bodies(7, std::vector{ball(kInHair)});
    EXPECT_EQ(scene.step().touched, 0u);
    alone.step();
  }
  EXPECT_EQ(scene.displacement(), alone.displacement());
  EXPECT_FALSE(scene.world.lattice(scene.id).is_touched);
}

TEST(WorldTouch, hair_rests_on_a_prop_and_sleeps_and_wakes_when_it_is_taken_away) {
  Scene scene;
  const TouchBody prop = ball(kInHair, kProp, 0.04);
  scene.put({prop});
  // Hair settles after kSettleAfter_s = 8 s, creeps less and less on a body, and sleeps after kSleepAfter_s more; 40 s
  // are ample.
  scene.pass(40);
  EXPECT_TRUE(scene.world.lattice(scene.id).asleep);
  EXPECT_TRUE(scene.world.lattice(scene.id).is_touched);
  // Scene() is hair in its design: the prop must have displaced the hair by 2 mm RMS, and lose it again by this much
  // below.
  EXPECT_GT(rms_m(scene.displacement(), Scene().displacement()), 0.002);
  for (const Vec3& point : scene.points())
    // Contact is elastic, so points may press into the prop by up to 5 mm.
    EXPECT_GT(shape_distance(prop.shape, prop.place.inverse().point(point)), -0.005);
  scene.put({});
  EXPECT_EQ(scene.step().asleep, 0u);
  EXPECT_FALSE(scene.world.lattice(scene.id).is_touched);
  scene.pass(10);
  EXPECT_LT(rms_m(scene.displacement(), Scene().displacement()), 0.002);
}

// The prop moves by 0.05 mm a tick, less than the 0.3 mm (kStillShift_m) that count as still. Its movement since the
// hair fell asleep must count, or hair would sleep inside a slow prop.
TEST(WorldTouch, a_prop_that_moves_wakes_hair_however_slowly) {
  Scene scene;
  scene.put({ball(kInHair, kProp)});
  scene.pass(40);
  ASSERT_TRUE(scene.world.lattice(scene.id).asleep);
  bool is_awake = false;
  for (int tick = 1; tick <= 30; ++tick) {
    scene.put({ball(kInHair + Vec3(5e-5 * tick, 0, 0), kProp)});
    is_awake |= scene.step().asleep == 0;
  }
  EXPECT_TRUE(is_awake);
}

// The hand moves 10 cm to the middle of the hair in 0.3 s. Hair there must follow by at least 5 mm in the hand's
// direction, and stay finite while the hand goes on.
TEST(WorldTouch, a_hand_that_strokes_carries_hair_along) {
  for (const double way_m : {0.2, -0.2}) {
    Scene scene;
    const std::vector<Vec3> before = scene.points();
    const Vec3 side(way_m / 2, 0, 0);
    scene.move(kInHair - side, kInHair, 0.3);
    EXPECT_GT(mean_way(before, scene.points(), kInHair).x() * way_m, 0.005 * std::abs(way_m));
    scene.move(kInHair, kInHair + side, 0.3);
    ASSERT_TRUE(scene.is_finite());
    EXPECT_EQ(scene.last.lattices_reset, 0u);
  }
}

// One person has all 32 shapes that hands may have (kHandShapesMax). Each is at a random place within 20 cm in every
// tick, so that many are faster than kTouchSpeedMax_m_per_s and jump instead of sweeping. The parameter says whether
// the hands also hold hair.
class WildHands : public testing::TestWithParam<bool> {};

TEST_P(WildHands, leave_hair_finite_and_let_it_come_back) {
  Scene scene;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-0.2, 0.2);
  float fastest_m_per_s = 0;
  for (int tick = 0; tick < 300; ++tick) {
    std::vector<TouchBody> bodies;
    for (std::uint8_t number = 0; number < 32; ++number) {
      const double angle_rad = 20 * any(random), x = any(random), y = any(random), z = any(random);
      const RigidTransform place = support::turned(angle_rad, {x, 1, z}, kHead + Vec3(x, y, z));
      bodies.push_back({{kOwner, number}, number % 2 ? capsule(0.1, 0.02) : sphere(0.03), place, tick % 7 == 0});
    }
    scene.put(bodies);
    const TouchKey hand{kOwner, static_cast<std::uint8_t>(tick % 32)};
    if (GetParam()) scene.world.grab(scene.id, {hand, Vec3::Zero(), 0.1});
    EXPECT_EQ(scene.step().lattices_reset, 0u);
    fastest_m_per_s = std::max(fastest_m_per_s, scene.world.state(scene.id).speed_max_m_per_s);
    ASSERT_TRUE(scene.is_finite());
  }
  // Hair that is held goes as fast as the hand pulls it, so the limit of speed holds for hair that is only touched.
  if (!GetParam()) {
    EXPECT_LT(fastest_m_per_s, 2 * kTouchSpeedMax_m_per_s);
  }
  scene.put({});
  // Hair must come back to within a centimetre of its design: nothing of the touch may remain.
  scene.pass(8);
  EXPECT_LT(rms_m(scene.displacement(), Scene().displacement()), 0.01);
}

INSTANTIATE_TEST_SUITE_P(WorldTouch, WildHands, testing::Bool(),
                         [](const auto& grabs) { return grabs.param ? "that_hold_hair" : "that_hold_nothing"; });

// The hand jumps by 40 cm to and fro in every tick, that is 12 m/s, above kTouchSpeedMax_m_per_s = 8. Such a hand must
// appear at its new place without a sweep, which would throw the hair.
TEST(WorldTouch, a_hand_that_jumps_across_the_head_does_not_fling_hair) {
  Scene scene;
  float fastest_m_per_s = 0;
  for (int tick = 0; tick < 120; ++tick) {
    scene.put({ball(kInHair + Vec3(tick % 2 ? 0.2 : -0.2, 0, 0))});
    scene.step();
    fastest_m_per_s = std::max(fastest_m_per_s, scene.world.state(scene.id).speed_max_m_per_s);
  }
  EXPECT_LT(fastest_m_per_s, 2);
}

// The hand takes hold, moves by 4 cm in a second and stays for another. The hair must follow by more than 1 cm, and
// after the drop come back to where untouched hair is after the same 7 s.
TEST(WorldTouch, pulled_hair_follows_the_hand_and_returns_when_it_is_dropped) {
  Scene scene, alone;
  scene.put({ball(kInHair)});
  scene.pass(1);
  const std::vector<Vec3> before = scene.points();
  ASSERT_GT(scene.world.grab(scene.id, {kHand, Vec3::Zero(), 0.08}), 0u);
  const Vec3 pull(0, 0, 0.04);
  scene.move(kInHair, kInHair + pull, 1);
  scene.pass(1);
  EXPECT_GT(mean_way(before, scene.points(), kInHair).z(), 0.01);
  scene.world.let_go(scene.id, kHand, Release::drop);
  scene.put({});
  scene.pass(4);
  alone.pass(7);
  EXPECT_LT(rms_m(scene.displacement(), alone.displacement()), 0.01);
  EXPECT_EQ(scene.last.touched, 0u);
}

TEST(WorldTouch, a_grab_takes_the_points_within_its_radius) {
  Scene scene;
  scene.put({ball(kInHair)});
  scene.step();
  const std::vector<Vec3> points = scene.points();
  const Vec3 own(0.01, 0.02, -0.03);
  // The test counts the points within 10 cm of the grabbed place on the hand, in world coordinates.
  const auto in_reach = std::ranges::count_if(points, [&](const Vec3& p) { return (p - kInHair - own).norm() <= 0.1; });
  ASSERT_GT(in_reach, 1);
  EXPECT_EQ(scene.world.grab(scene.id, {kHand, own, 0.1}), static_cast<std::uint32_t>(in_reach));
  // A second grab of the same hand first lets go, so no point is counted twice.
  EXPECT_EQ(scene.world.grab(scene.id, {kHand, own, 0.1}), static_cast<std::uint32_t>(in_reach));
  // The room has no such body.
  EXPECT_EQ(scene.world.grab(scene.id, {{kOwner, 2}, own, 0.1}), 0u);
  // The place is a metre away from the hand's body and from the hair.
  EXPECT_EQ(scene.world.grab(scene.id, {kHand, {1, 0, 0}, 0.1}), 0u);
  scene.put({});
  // The last grab, which found nothing, has let go of the points before it, so no hold is left to end.
  EXPECT_EQ(scene.step().holds_ended, 0u);
}

// Eight hands grab at the same place with the greatest radius, so that they reach more points than kStepHoldsMax = 128
// in all.
TEST(WorldTouch, no_more_points_than_a_step_takes_are_held) {
  Scene scene;
  std::vector<TouchBody> hands;
  for (std::uint8_t number = 0; number < 8; ++number) hands.push_back(ball(kInHair, {kOwner, number}));
  scene.put(hands);
  std::uint32_t held = 0;
  for (const TouchBody& hand : hands) held += scene.world.grab(scene.id, {hand.key, Vec3::Zero(), kGrabRadiusMax_m});
  EXPECT_EQ(held, kStepHoldsMax);
  scene.step();
  EXPECT_TRUE(scene.is_finite());
}

TEST(WorldTouch, hair_is_let_go_once_when_the_hand_is_gone_or_tears_away) {
  Scene scene;
  const auto grab = [&] {
    scene.put({ball(kInHair)});
    scene.step();
    ASSERT_GT(scene.world.grab(scene.id, {kHand, Vec3::Zero(), 0.1}), 1u);
    EXPECT_EQ(scene.step().holds_ended, 0u);
  };
  grab();
  scene.put({});
  EXPECT_EQ(scene.step().holds_ended, 1u);
  EXPECT_EQ(scene.step().holds_ended, 0u);
  grab();
  // A metre in a tick is a jump (kTouchSpeedMax_m_per_s) and far beyond kHoldStretchMax_m = 0.25 m. The hair must be
  // let go rather than thrown.
  scene.put({ball(kInHair + Vec3(0, 0, 1))});
  EXPECT_EQ(scene.step().holds_ended, 1u);
  EXPECT_LT(scene.world.state(scene.id).speed_max_m_per_s, 1);
}

// A body with `only_own` touches only the hair of its own person, even where the character's rule allows everyone. A
// hand that gets this flag while it holds another's hair must let go.
TEST(WorldTouch, a_hand_that_may_touch_only_its_own_passes_through_hair_of_others_and_lets_go_of_it) {
  TouchBody own = ball(kInHair), others = ball(kInHair, {kStranger, 1});
  own.only_own = others.only_own = true;
  Scene scene, alone;
  scene.world.set_touch_rule(scene.id, {TouchAudience::everyone});
  scene.put({others});
  EXPECT_EQ(scene.step().bodies_refused, 1u);
  EXPECT_EQ(scene.world.grab(scene.id, {others.key, Vec3::Zero(), 0.1}), 0u);
  alone.step();
  EXPECT_EQ(scene.displacement(), alone.displacement());
  scene.put({own});
  EXPECT_EQ(scene.step().touched, 1u);
  EXPECT_GT(scene.world.grab(scene.id, {own.key, Vec3::Zero(), 0.1}), 0u);

  others.only_own = false;
  scene.put({others});
  scene.step();
  ASSERT_GT(scene.world.grab(scene.id, {others.key, Vec3::Zero(), 0.1}), 0u);
  scene.step();
  EXPECT_GT(scene.world.held_count(scene.id, others.key), 0u);
  others.only_own = true;
  scene.put({others});
  EXPECT_EQ(scene.step().holds_ended, 1u);
  EXPECT_EQ(scene.world.held_count(scene.id, others.key), 0u);
}

TEST(WorldTouch, a_count_of_held_points_is_of_one_hand_without_pins) {
  Scene scene;
  const TouchKey left{kOwner, 2};
  scene.put({ball(kInHair), ball(kInHair, left)});
  scene.step();
  const std::uint32_t taken = scene.world.grab(scene.id, {kHand, Vec3::Zero(), 0.1});
  ASSERT_GT(taken, 0u);
  EXPECT_EQ(scene.world.held_count(scene.id, kHand), taken);
  EXPECT_EQ(scene.world.held_count(scene.id, left), 0u);
  EXPECT_EQ(scene.world.held_count({}, kHand), 0u);
  scene.world.let_go(scene.id, kHand, Release::pin);
  EXPECT_EQ(scene.world.held_count(scene.id, kHand), 0u);
}

// Each of these ends all holds without counting them as lost: afterwards there is nothing for the hand to hold.
TEST(WorldTouch, a_teleport_and_other_levels_and_rules_end_holds) {
  const std::vector<std::function<void(Scene&)>> ends{
      [](Scene& s) {
        s.world.set_pose(s.id, rigid_pose({Quat::Identity(), kHead + Vec3(0, 0, 0.05)}), true);
      },
      [](Scene& s) { EXPECT_TRUE(s.world.set_level(s.id, LevelIndex::low)); },
      [](Scene& s) { EXPECT_TRUE(s.world.set_level(s.id, LevelIndex::learnt)); },
      [](Scene& s) { EXPECT_TRUE(s.world.set_level(s.id, LevelIndex::rigid)); },
      [](Scene& s) { s.world.set_touch_rule(s.id, {TouchAudience::nobody}); },
      [](Scene& s) { s.world.set_suspended(s.id, true); },
  };
  for (const auto& end : ends) {
    Scene scene;
    scene.put({ball(kInHair)});
    scene.step();
    ASSERT_GT(scene.world.grab(scene.id, {kHand, Vec3::Zero(), 0.1}), 0u);
    scene.move(kInHair, kInHair + Vec3(0, 0, 0.02), 0.5);
    end(scene);
    scene.step();
    scene.world.set_suspended(scene.id, false);
    scene.put({});
    // The hand is gone. A hold that were left would end in this step, and be counted.
    EXPECT_EQ(scene.step().holds_ended, 0u);
  }
}

// The hand pulls hair by 3.6 cm, pins it to the head and leaves. The pin must hold through two seconds of rest and
// while the head turns by 1.2 rad; only the owner may unpin it.
TEST(WorldTouch, a_pinned_lock_stays_on_the_head_until_it_is_unpinned) {
  Scene scene;
  scene.put({ball(kInHair)});
  scene.step();
  ASSERT_GT(scene.world.grab(scene.id, {kHand, Vec3::Zero(), 0.1}), 0u);
  scene.move(kInHair, kInHair + Vec3(0.02, 0, 0.03), 1);
  scene.pass(1);
  scene.world.let_go(scene.id, kHand, Release::pin);
  scene.put({});
  EXPECT_EQ(scene.step().holds_ended, 0u);
  scene.pass(2);
  const std::vector<Vec3f> pinned = scene.displacement();
  const double pinned_m = rms_m(pinned, Scene().displacement());
  // The pin must hold the hair at least 3 mm RMS away from its design, or the comparisons below test nothing.
  EXPECT_GT(pinned_m, 0.003);
  for (int tick = 0; tick <= 60; ++tick) {
    scene.world.set_pose(scene.id, rigid_pose(support::turned(0.02 * tick, Vec3::UnitY(), kHead)));
    scene.step();
  }
  scene.pass(40);
  EXPECT_TRUE(scene.world.lattice(scene.id).asleep);
  EXPECT_LT(rms_m(scene.displacement(), pinned), 0.3 * pinned_m);
  // A stranger has no pins here, so nothing happens; any hand of the owner ends all pins, and hair wakes.
  scene.world.let_go(scene.id, {kStranger, 1}, Release::unpin);
  EXPECT_EQ(scene.step().asleep, 1u);
  scene.world.let_go(scene.id, {kOwner, 8}, Release::unpin);
  EXPECT_EQ(scene.step().asleep, 0u);
  scene.pass(8);
  EXPECT_LT(rms_m(scene.displacement(), Scene().displacement()), 0.2 * pinned_m);
}

// The room has 30 props in a row away from the head, and a step takes the nearest 24 (kStepBodiesMax). The hair must
// move exactly as if the other six did not exist.
TEST(WorldTouch, of_too_many_bodies_the_nearest_are_met) {
  Scene crowded, scene;
  std::vector<TouchBody> bodies;
  for (std::uint8_t number = 0; number < 30; ++number) {
    const Vec3 place = kHead + Vec3(0, -0.04, 0.002 * (number + 1));
    bodies.push_back(ball(place, {kRoomToucher, number}, 0.05));
  }
  for (int tick = 0; tick < 30; ++tick) {
    crowded.put(bodies);
    scene.put({bodies.begin(), bodies.begin() + kStepBodiesMax});
    EXPECT_EQ(crowded.step().bodies_left_out, 30 - kStepBodiesMax);
    EXPECT_EQ(scene.step().bodies_left_out, 0u);
  }
  EXPECT_EQ(crowded.displacement(), scene.displacement());
}

TEST(WorldTouch, only_hair_on_a_lattice_is_moved_but_all_know_that_they_are_touched) {
  for (const LevelIndex level : {LevelIndex::high, LevelIndex::ether, LevelIndex::learnt, LevelIndex::rigid}) {
    Scene scene(level);
    scene.put({ball(kInHair)});
    EXPECT_EQ(scene.step().touched, 1u);
    EXPECT_TRUE(scene.world.lattice(scene.id).is_touched);
    EXPECT_EQ(scene.world.grab(scene.id, {kHand, Vec3::Zero(), 0.1}) > 0, has_lattice(level));
    scene.put({});
    scene.step();
    EXPECT_EQ(scene.step().touched, 0u);
  }
  Scene suspended;
  suspended.put({ball(kInHair)});
  suspended.world.set_suspended(suspended.id, true);
  EXPECT_EQ(suspended.step().touched, 0u);
  EXPECT_EQ(suspended.world.grab(suspended.id, {kHand, Vec3::Zero(), 0.1}), 0u);
}

// With a stride of 4, untouched hair is stepped in every fourth tick. A hand would meet hair that stands still in
// between.
TEST(WorldTouch, touched_hair_has_a_turn_in_every_tick) {
  Scene scene;
  scene.world.set_stride(scene.id, 4);
  scene.pass(0.4);
  for (int tick = 0; tick < 8; ++tick) {
    scene.put({ball(kInHair + Vec3(0.005 * tick, 0, 0))});
    EXPECT_EQ(scene.step().stepped, 1u);
  }
}

// Runs 40 characters of seven owners and all levels through 30 ticks of eight passing hands, with grabs and pins, and
// returns the hash of the world after each tick.
std::vector<std::uint64_t> hashes_of_a_run(const ParallelFor& parallel_for) {
  WorldDef def;
  def.parallel_for = parallel_for;
  Scene scene(LevelIndex::high, def);
  std::vector<CharacterId> ids{scene.id};
  for (std::uint32_t i = 1; i < 40; ++i) {
    const Pose pose = rigid_pose({Quat::Identity(), kHead + Vec3(0.1 * i, 0, 0)});
    ids.push_back(scene.world.add({make_levels(), static_cast<LevelIndex>(i % kLevelCount), pose, 0, i % 7}));
    if (i % 3 == 0) scene.world.set_touch_rule(ids.back(), {TouchAudience::everyone});
  }
  std::vector<std::uint64_t> hashes;
  for (int tick = 0; tick < 30; ++tick) {
    std::vector<TouchBody> bodies;
    for (std::uint32_t toucher = 0; toucher < 8; ++toucher)
      bodies.push_back(ball(kInHair + Vec3(0.5 * toucher + 0.02 * tick, 0, 0), {toucher, 0}));
    scene.put(bodies);
    if (tick == 5) {
      for (const CharacterId id : ids) scene.world.grab(id, {{5, 0}, Vec3::Zero(), 0.1});
    }
    if (tick == 20) {
      for (const CharacterId id : ids) scene.world.let_go(id, {5, 0}, Release::pin);
    }
    scene.step();
    hashes.push_back(scene.world.hash());
  }
  return hashes;
}

TEST(WorldTouch, gives_the_same_bits_in_any_order_of_characters) {
  const auto shuffled = [random = std::make_shared<std::mt19937>(5)](std::size_t count,
                                                                     const std::function<void(std::size_t)>& body) {
    std::vector<std::size_t> order(count);
    std::iota(order.begin(), order.end(), 0u);
    std::shuffle(order.begin(), order.end(), *random);
    for (const std::size_t i : order) body(i);
  };
  EXPECT_EQ(hashes_of_a_run({}), hashes_of_a_run(shuffled));
}

// A replay compares hashes, so whatever moves hair must be in them.
TEST(WorldTouch, a_hash_tells_of_bodies_and_of_holds) {
  const auto hash = [](const Vec3& place, double radius_m) {
    Scene scene;
    scene.put({ball(place)});
    EXPECT_EQ(scene.world.grab(scene.id, {kHand, Vec3::Zero(), radius_m}) > 0, radius_m > 0);
    return scene.world.hash();
  };
  const std::uint64_t far = hash(kHead + Vec3(9, 0, 0), 0);
  EXPECT_NE(far, Scene().world.hash());
  EXPECT_NE(far, hash(kHead + Vec3(9, 0, 1), 0));
  EXPECT_NE(hash(kInHair, 0), hash(kInHair, 0.1));
  EXPECT_NE(hash(kInHair, 0.06), hash(kInHair, 0.12));
}

// All inputs belong to one tick. A grab must find the body that the same inputs bring, or each grab of a new hand would
// fail.
TEST(SimulationTouch, bodies_come_before_the_grabs_of_their_tick) {
  GroomHash groom{};
  Simulation simulation({});
  simulation.put_levels(groom, make_levels());
  SimulationInputs inputs;
  inputs.added.push_back({1, groom, 3, true, LevelIndex::medium, rigid_pose({Quat::Identity(), kHead}), kStranger});
  inputs.touch_rules.push_back({1, {TouchAudience::chosen, {kOwner}}});
  inputs.bodies.push_back({3, {ball(kInHair), ball(kInHair, {kStranger, 1})}});
  inputs.grabs.push_back({1, {kHand, Vec3::Zero(), 0.1}});
  inputs.grabs.push_back({2, {kHand, Vec3::Zero(), 0.1}});
  inputs.grabs.push_back({1, {{kStranger, 1}, Vec3::Zero(), 0.1}});
  EXPECT_EQ(simulation.step(inputs).touched, 1u);
  ASSERT_EQ(simulation.held_counts().size(), 3u);
  EXPECT_GT(simulation.held_counts()[0], 0u);
  EXPECT_EQ(simulation.held_counts()[1], 0u);
  EXPECT_EQ(simulation.held_counts()[2], simulation.held_counts()[0]);
  inputs = {};
  inputs.releases.push_back({1, kHand, Release::drop});
  inputs.bodies.push_back({3, {}});
  // The owner has let go; the hold that ends is the stranger's, whose body the room no longer has.
  EXPECT_EQ(simulation.step(inputs).holds_ended, 1u);
  EXPECT_TRUE(simulation.held_counts().empty());
}

}  // namespace
}  // namespace hairnet
