#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "core/world/world.hpp"
#include "tests/support/levels.hpp"

namespace hairnet {
namespace {

std::shared_ptr<const LevelSet> make_levels() {
  auto levels = std::make_shared<LevelSet>();
  for (std::size_t i = 0; i < 4; ++i) {
    levels->levels[i] = support::make_random_level({.nodes_per_axis = 6 - static_cast<int>(i)});
  }
  return levels;
}

Pose swaying(int tick) {
  const double t = tick / 30.0;
  return rigid_pose(support::turned(0.5 * std::sin(6 * t), {0.2, 1, 0.1}, {0.2 * std::sin(5 * t), 1.5, 0}));
}

Environment windy(double x_m_per_s) {
  return {.wind = WindField({.mean_m_per_s = {x_m_per_s, 0, 0.5}, .gust_ratio = 0.5})};
}

std::vector<Vec3f> displacement(const World& world, CharacterId id) {
  const auto nodes = world.lattice(id).displacement;
  return {nodes.begin(), nodes.end()};
}

// Thirty characters share a world and have three environments. Each must move bit for bit as alone in a world with its
// environment.
TEST(Environments, blow_about_their_own_characters_alone) {
  const auto levels = make_levels();
  World rooms({});
  rooms.set_environment(0, windy(1));
  rooms.set_environment(2, windy(-2));
  std::vector<CharacterId> ids;
  for (std::uint32_t i = 0; i < 30; ++i) {
    ids.push_back(rooms.add({levels, LevelIndex::low, swaying(0), i % 3}));
  }
  std::vector<World> alone;
  std::vector<CharacterId> alone_ids;
  for (std::uint32_t e = 0; e < 3; ++e) {
    WorldDef def;
    // Environment 1 was never set, and has still air.
    if (e == 0) def.environment = windy(1);
    if (e == 2) def.environment = windy(-2);
    alone.emplace_back(def);
    alone_ids.push_back(alone[e].add({levels, LevelIndex::low, swaying(0)}));
  }
  for (int tick = 1; tick < 20; ++tick) {
    for (const CharacterId id : ids) rooms.set_pose(id, swaying(tick));
    rooms.step();
    for (std::uint32_t e = 0; e < 3; ++e) {
      alone[e].set_pose(alone_ids[e], swaying(tick));
      alone[e].step();
    }
  }
  for (std::uint32_t i = 0; i < ids.size(); ++i) {
    EXPECT_EQ(displacement(rooms, ids[i]), displacement(alone[i % 3], alone_ids[i % 3])) << "character " << i;
  }
  EXPECT_NE(displacement(rooms, ids[0]), displacement(rooms, ids[2]));
}

TEST(Environments, wake_their_own_characters_alone) {
  const auto levels = make_levels();
  World world({});
  const CharacterId here = world.add({levels, LevelIndex::low, {}, 0});
  const CharacterId there = world.add({levels, LevelIndex::low, {}, 1});
  // Hair sleeps after kSleepAfter_s, 4.5 s, at rest; 300 ticks are 10 s.
  for (int tick = 0; tick < 300 && world.step().asleep < 2; ++tick) {
  }
  ASSERT_TRUE(world.lattice(here).asleep && world.lattice(there).asleep);
  world.set_environment(1, windy(1));
  world.step();
  EXPECT_TRUE(world.lattice(here).asleep);
  EXPECT_FALSE(world.lattice(there).asleep);
}

// A room moves from server to server with the state of its hair. With another bit, hair would twitch at each move.
TEST(State, restored_continues_as_without_a_break) {
  const auto levels = make_levels();
  World before({}), after({});
  const CharacterId a = before.add({levels, LevelIndex::medium, swaying(0)});
  for (int tick = 1; tick <= 10; ++tick) {
    before.set_pose(a, swaying(tick));
    before.step();
  }
  const CharacterId b = after.add({levels, LevelIndex::medium, swaying(10)});
  ASSERT_TRUE(after.set_state(b, before.state(a).displacement, before.state(a).velocity));
  for (int tick = 11; tick <= 20; ++tick) {
    for (const auto& [world, id] : {std::pair{&before, a}, std::pair{&after, b}}) {
      world->set_pose(id, swaying(tick));
      world->step();
    }
    EXPECT_EQ(displacement(before, a), displacement(after, b)) << "tick " << tick;
  }
}

TEST(State, without_velocities_hair_moves_with_the_head) {
  const auto levels = make_levels();
  World world({});
  const CharacterId id = world.add({levels, LevelIndex::medium, {}});
  const std::vector<Vec3f> at_rest(levels->levels[1].rest.size(), Vec3f::Zero());
  ASSERT_TRUE(world.set_state(id, at_rest, {}));
  float without_m = 0;
  world.set_pose(id, rigid_pose({Quat::Identity(), {0, 0, 0.1}}));
  world.step();
  for (const Vec3f& d : displacement(world, id)) without_m = std::max(without_m, d.norm());
  const std::vector<Vec3f> standing(at_rest.size(), Vec3f::Zero());
  World left_behind({});
  const CharacterId other = left_behind.add({levels, LevelIndex::medium, {}});
  ASSERT_TRUE(left_behind.set_state(other, at_rest, standing));
  left_behind.set_pose(other, rigid_pose({Quat::Identity(), {0, 0, 0.1}}));
  left_behind.step();
  float standing_m = 0;
  for (const Vec3f& d : displacement(left_behind, other)) standing_m = std::max(standing_m, d.norm());
  // Hair that moves with the head is held back by drag alone; hair that stands still in the world is left behind by
  // most of the head's 10 cm.
  EXPECT_LT(without_m, 0.3f * standing_m);
}

TEST(State, that_is_invalid_is_refused_and_changes_nothing) {
  auto levels = std::make_shared<LevelSet>(*make_levels());
  for (Level& level : levels->levels) level.displacement_max_m = 0.3f;
  World world({});
  const CharacterId id = world.add({levels, LevelIndex::low, {}});
  const std::size_t count = levels->levels[2].rest.size();
  const std::vector<Vec3f> good(count, Vec3f(0.1f, 0, 0)), still(count, Vec3f::Zero());
  const std::uint64_t hash = world.hash();
  const auto refuses = [&](const std::vector<Vec3f>& d, const std::vector<Vec3f>& v) {
    return !world.set_state(id, d, v) && world.hash() == hash;
  };
  // The level allows 0.3 m, and 2 mm more for the rounding of the wire.
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 0.31f, 1e30f}) {
    std::vector<Vec3f> d = good;
    d.back().y() = bad;
    EXPECT_TRUE(refuses(d, still)) << bad;
  }
  // A node may have a speed of up to 1000 m/s (World::set_state).
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity(), 1001.0f, 1e30f}) {
    std::vector<Vec3f> v = still;
    v.front().z() = bad;
    EXPECT_TRUE(refuses(good, v)) << bad;
  }
  EXPECT_TRUE(refuses({good.begin(), good.end() - 1}, still));
  EXPECT_TRUE(refuses(good, {still.begin(), still.end() - 1}));
  EXPECT_TRUE(refuses({}, {}));
  EXPECT_FALSE(world.set_state({17, 1}, good, still));
  EXPECT_TRUE(world.set_state(id, good, still));
  EXPECT_NE(world.hash(), hash);
  world.set_level(id, LevelIndex::rigid);
  EXPECT_FALSE(world.set_state(id, good, still)) << "a lattice on its way to rigid";
}

std::int64_t fake_now_ns() {
  static std::int64_t now_ns = 0;
  return now_ns += 1000;
}

TEST(Costs, are_reported_by_level_and_number_of_ticks) {
  const auto levels = make_levels();
  WorldDef def;
  def.now_ns = fake_now_ns;
  World world(def);
  std::vector<CharacterId> ids;
  for (int i = 0; i < 6; ++i) ids.push_back(world.add({levels, i < 2 ? LevelIndex::high : LevelIndex::low, {}}));
  (void)world.add({levels, LevelIndex::rigid, {}});
  world.set_stride(ids[5], 2);
  // With a stride of 2, slot 5 has its turns in odd ticks, so none in this one but in the next.
  world.step();
  const StepCosts second = world.step().costs;
  EXPECT_EQ(second.of(LevelIndex::high, 1).character_steps, 2u);
  EXPECT_EQ(second.of(LevelIndex::low, 1).character_steps, 3u);
  EXPECT_EQ(second.of(LevelIndex::low, 2).character_steps, 1u);
  EXPECT_EQ(second.of(LevelIndex::rigid, 1).character_steps, 0u);
  // The clock advances by 1000 ns with each reading, and a batch lies between two.
  EXPECT_EQ(second.of(LevelIndex::high, 1).step_ns, 1000);
  EXPECT_EQ(second.of(LevelIndex::low, 2).step_ns, 1000);
  EXPECT_EQ(second.of(LevelIndex::medium, 1).step_ns, 0);
  const StepCosts third = world.step().costs;
  EXPECT_EQ(third.of(LevelIndex::low, 2).character_steps, 0u);
}

}  // namespace
}  // namespace hairnet
