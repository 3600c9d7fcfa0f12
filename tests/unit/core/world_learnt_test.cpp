#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "core/world/world.hpp"
#include "tests/support/learnt.hpp"
#include "tests/support/levels.hpp"

namespace hairnet {
namespace {

// Six seconds of 30 ticks are longer than kSleepAfter_s = 4.5 s.
constexpr int kRestTicks = 30 * 6;

std::shared_ptr<const LevelSet> make_levels(bool with_learnt = true) {
  auto levels = std::make_shared<LevelSet>();
  for (Level& level : levels->levels) level = support::make_random_level({.nodes_per_axis = 4});
  if (with_learnt) levels->learnt = std::make_shared<LearntHair>(support::random_learnt_hair(3));
  return levels;
}

Pose swaying(int character, int tick) {
  const double t = tick / 30.0 + character;
  return rigid_pose(support::turned(0.3 * std::sin(4 * t), {0.2, 1, 0.1}, {0.1 * std::sin(3 * t), 1.5, 0}));
}

std::vector<float> coefficients(const World& world, CharacterId id) {
  const std::span<const float> c = world.lattice(id).coefficients;
  return {c.begin(), c.end()};
}

// Evaluates the network directly, without a World: its constructor holds the first pose for kLearntStart_ticks, as
// World does, and each step is one tick.
class Reference {
 public:
  Reference(const LearntHair& hair, const Pose& first, const Vec3& air_world = Vec3::Zero())
      : hair_(&hair), coefficients_(hair.mode_count) {
    for (int tick = 0; tick < kLearntStart_ticks; ++tick) step(first, air_world);
  }
  const std::vector<float>& step(const Pose& pose, const Vec3& air_world = Vec3::Zero()) {
    LearntMember member{&state_, &pose, coefficients_, air_world};
    step_learnt(*hair_, {&member, 1});
    return coefficients_;
  }

 private:
  const LearntHair* hair_;
  LearntState state_;
  std::vector<float> coefficients_;
};

// A World only passes poses on to the network, so its coefficients must have the same bits as those of the network
// alone.
TEST(LearntLevel, is_what_the_network_makes_of_the_poses) {
  World world({});
  const auto levels = make_levels();
  const CharacterId id = world.add({levels, LevelIndex::learnt, swaying(0, 0)});
  Reference expected(*levels->learnt, swaying(0, 0));
  for (int tick = 1; tick <= 60; ++tick) {
    world.set_pose(id, swaying(0, tick));
    EXPECT_EQ(world.step().stepped, 1u);
    EXPECT_EQ(coefficients(world, id), expected.step(swaying(0, tick))) << tick;
  }
  const LatticeView view = world.lattice(id);
  EXPECT_EQ(view.level, LevelIndex::learnt);
  EXPECT_EQ(view.model, nullptr);
  EXPECT_TRUE(view.displacement.empty());
  EXPECT_GT(std::abs(view.coefficients[0]), 1e-4f);
}

TEST(LearntLevel, moves_in_the_wind_at_the_head) {
  const WindField wind({.mean_m_per_s = {2, 0, 1}, .gust_ratio = 0.5, .turbulence_rms_m_per_s = 0.5});
  WorldDef def;
  def.environment.wind = wind;
  for (const int stride : {1, 2}) {
    World world(def);
    const auto levels = make_levels();
    const CharacterId id = world.add({levels, LevelIndex::learnt, swaying(0, 0)});
    world.set_stride(id, stride);
    const auto air = [&](const Pose& pose, double tick) {
      return wind.velocity(pose.head().position, tick * def.tick_s);
    };
    Pose from = swaying(0, 0);
    std::optional<Reference> expected;
    int turns = 0;
    for (int tick = 1; tick <= 60; ++tick) {
      const Pose to = swaying(0, tick);
      world.set_pose(id, to);
      world.step();
      if (!world.lattice(id).stepped) continue;
      // The first turn is in the first tick, whatever the stride, so it covers one tick.
      const int ticks = turns++ == 0 ? 1 : stride;
      if (!expected) expected.emplace(*levels->learnt, from, air(from, tick - ticks));
      if (ticks == 2) {
        const Pose between = interpolate(from, to, 0.5);
        expected->step(between, air(between, tick - 1));
      }
      EXPECT_EQ(coefficients(world, id), expected->step(to, air(to, tick))) << tick;
      EXPECT_TRUE(world.lattice(id).is_covered);
      from = to;
    }
    EXPECT_GE(turns, 60 / stride);
    Reference calm(*levels->learnt, swaying(0, 0));
    std::vector<float> in_still_air;
    for (int tick = 1; tick <= 60; ++tick) in_still_air = calm.step(swaying(0, tick));
    EXPECT_GT(std::abs(in_still_air[0] - coefficients(world, id)[0]), 1e-4f);
  }
}

// A network that was learnt in still air would show hair at rest in a storm. `is_covered` says this to the server.
TEST(LearntLevel, does_not_hold_in_wind_that_the_network_knows_nothing_of) {
  auto levels = std::make_shared<LevelSet>(*make_levels());
  auto still = std::make_shared<LearntHair>(*levels->learnt);
  still->wind = {};
  levels->learnt = still;
  World world({});
  const CharacterId id = world.add({levels, LevelIndex::learnt, {}});
  world.step();
  EXPECT_TRUE(world.lattice(id).is_covered);
  Environment windy;
  windy.wind = WindField({.mean_m_per_s = {1, 0, 0}});
  world.set_environment(windy);
  world.step();
  EXPECT_FALSE(world.lattice(id).is_covered);
}

// Hair that starts on a tilted head must hang already. If it started at rest in the design, it would fall for a second.
TEST(LearntLevel, begins_as_if_the_pose_had_been_held) {
  const Pose tilted = rigid_pose(support::turned(0.5, {1, 0, 0.3}, {0, 1.5, 0}));
  const auto levels = make_levels();
  World world({});
  const CharacterId id = world.add({levels, LevelIndex::learnt, tilted});
  world.step();
  const std::vector<float> first = coefficients(world, id);
  for (int tick = 0; tick < 60; ++tick) world.step();
  const std::vector<float> hanging = coefficients(world, id);
  EXPECT_GT(std::abs(hanging[0]), 1e-3f);
  for (std::size_t k = 0; k < first.size(); ++k) EXPECT_NEAR(first[k], hanging[k], 0.1 * std::abs(hanging[0])) << k;
}

// Characters with the same network are evaluated 16 at a time (kLearntWidth), in lanes. Neighbours of another network
// or another level must change no bit.
TEST(LearntLevel, of_one_character_is_the_same_in_any_crowd) {
  World crowd({}), alone({});
  const auto levels = make_levels(), others = make_levels();
  std::vector<CharacterId> ids;
  for (int n = 0; n < 40; ++n)
    ids.push_back(
        crowd.add({n % 3 == 0 ? others : levels, n % 5 == 0 ? LevelIndex::low : LevelIndex::learnt, swaying(n, 0)}));
  const CharacterId id = alone.add({levels, LevelIndex::learnt, swaying(7, 0)});
  for (int tick = 1; tick <= 30; ++tick) {
    for (int n = 0; n < 40; ++n) crowd.set_pose(ids[static_cast<std::size_t>(n)], swaying(n, tick));
    alone.set_pose(id, swaying(7, tick));
    EXPECT_EQ(crowd.step().stepped, 40u);
    alone.step();
    ASSERT_EQ(coefficients(crowd, ids[7]), coefficients(alone, id)) << tick;
  }
}

TEST(LearntLevel, counts_its_cost_as_its_own) {
  WorldDef def;
  def.now_ns = [] {
    static std::int64_t ns = 0;
    return ns += 1000;
  };
  World world(def);
  const auto levels = make_levels();
  for (int n = 0; n < 20; ++n) EXPECT_TRUE(world.add({levels, LevelIndex::learnt, swaying(n, 0)}));
  const StepReport report = world.step();
  EXPECT_EQ(report.costs.of(LevelIndex::learnt, 1).character_steps, 20u);
  // The clock advances by 1000 ns with each reading. 20 characters are two batches of at most kLearntWidth = 16, each
  // between two readings.
  EXPECT_EQ(report.costs.of(LevelIndex::learnt, 1).step_ns, 2000);
}

TEST(LearntLevel, over_several_ticks_takes_the_poses_between_as_well) {
  const auto levels = make_levels();
  World world({});
  const CharacterId id = world.add({levels, LevelIndex::learnt, swaying(0, 0)});
  world.set_stride(id, 2);
  Reference expected(*levels->learnt, swaying(0, 0));
  Pose from = swaying(0, 0);
  for (int tick = 1; tick <= 21; ++tick) {
    const Pose to = swaying(0, tick);
    world.set_pose(id, to);
    world.step();
    if (!world.lattice(id).stepped) continue;
    // The first turn covers one tick, and each later one two, so the network also sees the pose in the middle.
    if (tick > 1) expected.step(interpolate(from, to, 0.5));
    EXPECT_EQ(coefficients(world, id), expected.step(to)) << tick;
    from = to;
  }
}

TEST(LearntLevel, needs_a_network_and_ticks_of_its_length) {
  World world({});
  const CharacterId without = world.add({make_levels(false), LevelIndex::low, {}});
  EXPECT_FALSE(world.set_level(without, LevelIndex::learnt));
  EXPECT_EQ(world.lattice(without).level, LevelIndex::low);
  EXPECT_FALSE(world.set_level(world.add({}), LevelIndex::learnt));
  // A network has steps of kLearntTick_s = 1/30 s alone.
  WorldDef quick;
  quick.tick_s = 1.0 / 60;
  World other(quick);
  EXPECT_FALSE(other.set_level(other.add({make_levels(), LevelIndex::low, {}}), LevelIndex::learnt));
}

// A sleeping character costs no time and no bytes.
TEST(LearntLevel, falls_asleep_at_rest_and_wakes_with_the_bones) {
  World world({});
  const CharacterId id = world.add({make_levels(), LevelIndex::learnt, swaying(0, 0)});
  for (int tick = 1; tick < 30; ++tick) {
    world.set_pose(id, swaying(0, tick));
    world.step();
  }
  for (int tick = 0; tick < kRestTicks; ++tick) world.step();
  EXPECT_TRUE(world.lattice(id).asleep);
  const std::vector<float> at_rest = coefficients(world, id);
  EXPECT_EQ(world.step().asleep, 1u);
  EXPECT_EQ(coefficients(world, id), at_rest);
  world.set_pose(id, swaying(0, 40));
  EXPECT_EQ(world.step().stepped, 1u);
  EXPECT_FALSE(world.lattice(id).asleep);
}

TEST(LearntLevel, is_awake_in_wind) {
  World world({});
  const CharacterId id = world.add({make_levels(), LevelIndex::learnt, {}});
  Environment windy;
  windy.wind = WindField({.mean_m_per_s = {1, 0, 0}});
  world.set_environment(windy);
  for (int tick = 0; tick < kRestTicks; ++tick) EXPECT_EQ(world.step().stepped, 1u);
  EXPECT_FALSE(world.lattice(id).asleep);
}

// A jump of 30 m in one tick would otherwise be a velocity of 900 m/s for the network.
TEST(LearntLevel, takes_a_teleport_and_a_suspension_for_no_motion) {
  World world({});
  const CharacterId id = world.add({make_levels(), LevelIndex::learnt, {}});
  world.set_pose(id, rigid_pose(support::turned(0, {0, 1, 0}, {30, 0, 0})), true);
  EXPECT_EQ(world.step().teleports, 1u);
  EXPECT_TRUE(world.lattice(id).discontinuous);
  for (int tick = 0; tick < 5; ++tick) world.step();
  for (const float c : coefficients(world, id)) EXPECT_EQ(c, 0);
  world.set_suspended(id, true);
  world.set_pose(id, rigid_pose(support::turned(0, {0, 1, 0}, {30, 0, 0.2})));
  EXPECT_EQ(world.step().suspended, 1u);
  world.set_suspended(id, false);
  for (int tick = 0; tick < 5; ++tick) world.step();
  for (const float c : coefficients(world, id)) EXPECT_EQ(c, 0);
}

// The LOD changes levels when it likes, also twice within a second.
TEST(LearntLevel, is_left_and_entered_at_any_time) {
  World world({});
  const auto levels = make_levels();
  const CharacterId id = world.add({levels, LevelIndex::rigid, {}});
  int tick = 0;
  for (const LevelIndex level : {LevelIndex::learnt, LevelIndex::low, LevelIndex::learnt, LevelIndex::rigid,
                                 LevelIndex::high, LevelIndex::rigid, LevelIndex::learnt, LevelIndex::ether}) {
    ASSERT_TRUE(world.set_level(id, level));
    for (int n = 0; n < 4; ++n) {
      world.set_pose(id, swaying(0, ++tick));
      world.step();
    }
    const LatticeView view = world.lattice(id);
    if (level != LevelIndex::rigid) {
      EXPECT_EQ(view.level, level);
    }
    EXPECT_EQ(view.coefficients.size(), view.level == LevelIndex::learnt ? levels->learnt->mode_count : 0);
    EXPECT_EQ(view.displacement.empty(), !has_lattice(view.level));
  }
  world.set_level(id, LevelIndex::learnt);
  world.set_level_set(id, make_levels(false));
  EXPECT_EQ(world.lattice(id).level, LevelIndex::rigid);
}

TEST(LearntLevel, says_when_it_was_not_trained_for_the_motion) {
  auto levels = std::make_shared<LevelSet>(*make_levels());
  auto narrow = std::make_shared<LearntHair>(*levels->learnt);
  // This network has met no input above 1 in training, so a velocity of 3 m/s is beyond it.
  narrow->most.fill(1);
  levels->learnt = narrow;
  World world({});
  const CharacterId id = world.add({levels, LevelIndex::learnt, {}});
  world.step();
  EXPECT_TRUE(world.lattice(id).is_covered);
  // A tenth of a metre in a tick of 1/30 s is 3 m/s.
  for (int tick = 1; tick <= 3; ++tick) {
    world.set_pose(id, rigid_pose(support::turned(0, {0, 1, 0}, {0.1 * tick, 0, 0})));
    world.step();
    EXPECT_FALSE(world.lattice(id).is_covered);
  }
}

TEST(LearntLevel, is_part_of_the_hash) {
  World a({}), b({});
  const auto levels = make_levels();
  const CharacterId in_a = a.add({levels, LevelIndex::learnt, {}}), in_b = b.add({levels, LevelIndex::learnt, {}});
  for (int tick = 1; tick < 10; ++tick) {
    a.set_pose(in_a, swaying(0, tick));
    b.set_pose(in_b, swaying(0, tick));
    a.step();
    b.step();
    EXPECT_EQ(a.hash(), b.hash());
  }
  // A third world has the same poses and levels, but another network, whose state differs.
  const auto other_levels = std::make_shared<LevelSet>(*make_levels());
  other_levels->learnt = std::make_shared<LearntHair>(support::random_learnt_hair(4));
  World c({});
  const CharacterId in_c = c.add({other_levels, LevelIndex::learnt, {}});
  for (int tick = 1; tick < 10; ++tick) {
    c.set_pose(in_c, swaying(0, tick));
    c.step();
  }
  EXPECT_NE(a.hash(), c.hash());
}

}  // namespace
}  // namespace hairnet
