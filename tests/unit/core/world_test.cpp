#include "core/world/world.hpp"

#include <gtest/gtest.h>

#include <array>
#include <numeric>
#include <random>
#include <thread>

#include "core/levels/level_map.hpp"
#include "tests/support/levels.hpp"

namespace hairnet {
namespace {

// Adds the maps between the levels, which a change of level needs. The levels have no hair, so the rest places of the
// finest nodes serve as its points.
std::shared_ptr<const LevelSet> connected(const std::shared_ptr<LevelSet>& levels) {
  const std::vector<Vec3f>& points = levels->levels[0].rest;
  make_level_maps(*levels, points, std::vector<float>(points.size(), 1.0f));
  return levels;
}

// Makes four levels of random springs, from the finest to one that only the ether holds.
std::shared_ptr<const LevelSet> make_levels() {
  auto levels = std::make_shared<LevelSet>();
  levels->levels[0] = support::make_random_level({.nodes_per_axis = 6, .spring_count = 200, .attachment_count = 30});
  levels->levels[1] = support::make_random_level({.nodes_per_axis = 5});
  levels->levels[2] = support::make_random_level({.nodes_per_axis = 4});
  levels->levels[3] = support::make_random_level({.nodes_per_axis = 4, .spring_count = 0, .attachment_count = 0});
  return connected(levels);
}

// Returns the pose of a head that turns and shifts without a pause. Each character is at another time of the same
// motion.
Pose shaken(std::uint32_t character, int tick) {
  const double t = tick / 30.0 + character;
  Pose pose = rigid_pose(support::turned(0.6 * std::sin(5 * t), {0.2, 1, 0.1}, {0.2 * std::sin(3 * t), 1.5, 0}));
  return rounded_to_wire(pose);
}

// Moves 40 characters, spread over all levels, for 19 ticks, and returns the hash of the world after each. These levels
// have no learnt hair, so a character that asks for the learnt level stays rigid.
std::vector<std::uint64_t> hashes_of_a_run(const ParallelFor& parallel_for,
                                           const std::shared_ptr<const LevelSet>& levels) {
  WorldDef def;
  def.parallel_for = parallel_for;
  World world(def);
  std::vector<CharacterId> ids;
  for (std::uint32_t i = 0; i < 40; ++i)
    ids.push_back(world.add({levels, static_cast<LevelIndex>(i % kLevelCount), shaken(i, 0)}));
  std::vector<std::uint64_t> hashes;
  for (int tick = 1; tick < 20; ++tick) {
    for (std::uint32_t i = 0; i < ids.size(); ++i) world.set_pose(ids[i], shaken(i, tick));
    if (tick == 7) world.remove(ids[3]);
    if (tick == 9) world.set_level(ids[5], LevelIndex::low);
    world.step();
    hashes.push_back(world.hash());
  }
  return hashes;
}

// A loop that runs its bodies in a random order stands for threads, which finish in any order. State that batches
// shared by mistake would make the hashes differ.
TEST(World, gives_the_same_bits_in_any_order_of_characters) {
  const auto levels = make_levels();
  const auto forwards = hashes_of_a_run({}, levels);
  const auto shuffled = hashes_of_a_run(
      [random = std::make_shared<std::mt19937>(5)](std::size_t count, const std::function<void(std::size_t)>& body) {
        std::vector<std::size_t> order(count);
        std::iota(order.begin(), order.end(), 0u);
        std::shuffle(order.begin(), order.end(), *random);
        for (const std::size_t i : order) body(i);
      },
      levels);
  EXPECT_EQ(forwards, shuffled);
  EXPECT_NE(forwards.front(), forwards.back());
}

// Characters of one level are stepped in one batch, one lane each. A step that mixed lanes would change the character
// in company.
TEST(World, a_character_does_not_depend_on_other_characters) {
  const auto levels = make_levels();
  World alone({}), crowded({});
  const CharacterId a = alone.add({levels, LevelIndex::high, shaken(9, 0)});
  for (std::uint32_t i = 0; i < 9; ++i) (void)crowded.add({levels, LevelIndex::high, shaken(i, 0)});
  const CharacterId b = crowded.add({levels, LevelIndex::high, shaken(9, 0)});
  for (int tick = 1; tick < 15; ++tick) {
    alone.set_pose(a, shaken(9, tick));
    crowded.set_pose(b, shaken(9, tick));
    alone.step();
    crowded.step();
  }
  EXPECT_EQ(alone.state(a).displacement, crowded.state(b).displacement);
}

TEST(World, an_id_is_dead_once_removed_even_when_its_slot_is_taken_again) {
  World world({});
  const CharacterId first = world.add({nullptr, LevelIndex::rigid, {}});
  world.remove(first);
  const CharacterId second = world.add({nullptr, LevelIndex::rigid, {}});
  EXPECT_FALSE(world.contains(first));
  EXPECT_TRUE(world.contains(second));
  EXPECT_FALSE(world.contains(CharacterId{}));
  world.remove(first);
  EXPECT_EQ(world.character_count(), 1u);
}

TEST(World, gives_a_null_id_when_full) {
  WorldDef def;
  def.character_count_max = 2;
  World world(def);
  EXPECT_TRUE(world.add({}));
  EXPECT_TRUE(world.add({}));
  EXPECT_FALSE(world.add({}));
}

// A teleport must carry hair along unchanged. A step over the 50 m would fling the hair instead.
TEST(World, a_teleport_keeps_the_lattices_shape_in_head_space) {
  const auto levels = make_levels();
  World world({});
  const CharacterId id = world.add({levels, LevelIndex::medium, shaken(1, 0)});
  for (int tick = 1; tick < 10; ++tick) {
    world.set_pose(id, shaken(1, tick));
    world.step();
  }
  const LatticeState before = world.state(id);
  world.set_pose(id, rigid_pose(support::turned(2, {0, 1, 0}, {50, 0, 0})), true);
  EXPECT_EQ(world.step().teleports, 1u);
  EXPECT_EQ(world.state(id).displacement, before.displacement);
  EXPECT_EQ(world.lattice(id).pose->head().position.x(), 50);
}

TEST(World, takes_a_jump_too_large_to_simulate_for_a_teleport) {
  const auto levels = make_levels();
  World world({});
  const CharacterId id = world.add({levels, LevelIndex::low, Pose{}});
  // A tick of 1/30 s makes 0.8 m a speed of 24 m/s, just below the 25 m/s of is_teleport().
  world.set_pose(id, rigid_pose({Quat::Identity(), {0, 0, 0.8}}));
  EXPECT_EQ(world.step().teleports, 0u);
  // The next 2.2 m are 66 m/s, and differ from the 24 m/s before by more than is_teleport() allows.
  world.set_pose(id, rigid_pose({Quat::Identity(), {0, 0, 3}}));
  EXPECT_EQ(world.step().teleports, 1u);
  // A turn of 1.5 rad in a tick is 2578 degrees a second, just above the 2500 of is_teleport().
  world.set_pose(id, rigid_pose(support::turned(1.5, {0, 1, 0}, {0, 0, 3})));
  EXPECT_EQ(world.step().teleports, 1u);
}

// Without drag, hair that moves at a constant speed has no displacement. A change of level that lost the velocity would
// show as a jerk; 2e-6 m is left for the rounding of floats.
TEST(World, switching_levels_at_steady_translation_stays_rigid) {
  auto levels = std::make_shared<LevelSet>();
  for (std::size_t i = 0; i < 4; ++i) {
    levels->levels[i] = support::make_random_level({.nodes_per_axis = 6 - static_cast<int>(i), .drag = false});
  }
  World world({});
  const CharacterId id = world.add({connected(levels), LevelIndex::rigid, {}});
  constexpr std::array kLevels{LevelIndex::high, LevelIndex::medium, LevelIndex::low, LevelIndex::ether,
                               LevelIndex::rigid};
  Pose pose;
  for (std::size_t tick = 0; tick < 60; ++tick) {
    pose.bones.fill({Quat::Identity(), Vec3(0, 0, 0.05 * static_cast<double>(tick))});
    world.set_pose(id, pose);
    world.step();
    if (tick > 0) {
      ASSERT_TRUE(world.set_level(id, kLevels[(tick * 3) % kLevels.size()]));
    }
    for (const Vec3f& d : world.lattice(id).displacement) ASSERT_LT(d.norm(), 2e-6f) << "tick " << tick;
  }
}

// Gravity pulls with 3 m/s^2 to the side, and the ether of these levels holds with 40 N/m a kilogram, so hair leans by
// 3/40 m = 0.075 m. A level that started at rest would lose this lean.
TEST(World, switching_levels_keeps_a_lean) {
  const auto levels = make_levels();
  World world({});
  const CharacterId id = world.add({levels, LevelIndex::high, {}});
  WorldDef tilted;
  tilted.environment.gravity = {3, -9.81, 0};
  World leaning(tilted);
  const CharacterId leaner = leaning.add({levels, LevelIndex::ether, {}});
  for (int tick = 0; tick < 400; ++tick) leaning.step();
  const auto mean = [&] {
    const std::span<const Vec3f> d = leaning.lattice(leaner).displacement;
    return Vec3f(std::accumulate(d.begin(), d.end(), Vec3f(Vec3f::Zero())) / static_cast<float>(d.size()));
  };
  // Ether alone holds this level, so all nodes lean by about the same.
  const Vec3f before = mean();
  ASSERT_GT(before.norm(), 0.05f);
  ASSERT_TRUE(leaning.set_level(leaner, LevelIndex::medium));
  EXPECT_LT((mean() - before).norm(), 0.05f * before.norm());
  // No character has this slot.
  EXPECT_FALSE(world.set_level(CharacterId{77, 1}, LevelIndex::low));
  EXPECT_TRUE(world.set_level(id, LevelIndex::rigid));
  EXPECT_TRUE(world.lattice(id).displacement.empty());
}

// The list of changes has an unknown id, a removed one, and two changes of every third character. Of two changes of one
// character the later one must win, as in calls one after the other.
TEST(World, many_changes_of_level_at_once_are_what_each_in_turn_is) {
  const auto levels = make_levels();
  const ParallelFor on_threads = [](std::size_t count, const std::function<void(std::size_t)>& body) {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < count; ++i) threads.emplace_back([&body, i] { body(i); });
  };
  std::array<std::uint64_t, 2> hashes{};
  for (const bool at_once : {false, true}) {
    WorldDef def;
    if (at_once) def.parallel_for = on_threads;
    World world(def);
    std::vector<CharacterId> ids;
    for (std::uint32_t i = 0; i < 100; ++i)
      ids.push_back(world.add({levels, static_cast<LevelIndex>(i % 4), shaken(i, 0)}));
    for (int tick = 1; tick < 5; ++tick) {
      for (std::uint32_t i = 0; i < ids.size(); ++i) world.set_pose(ids[i], shaken(i, tick));
      world.step();
    }
    world.remove(ids[7]);
    std::vector<LevelChange> changes{{{77, 9}, LevelIndex::low}};
    // Number 4 is the learnt level, which these levels lack, so such a change must do nothing.
    for (std::size_t i = 0; i < ids.size(); ++i) changes.push_back({ids[i], static_cast<LevelIndex>(i % 5)});
    for (std::size_t i = 0; i < ids.size(); i += 3) changes.push_back({ids[i], LevelIndex::medium});
    if (at_once) {
      world.set_levels(changes);
    } else {
      for (const LevelChange& change : changes) world.set_level(change.id, change.level);
    }
    EXPECT_EQ(world.lattice(ids[3]).level, LevelIndex::medium);
    EXPECT_EQ(world.lattice(ids[5]).level, LevelIndex::high);
    world.step();
    hashes[at_once ? 1 : 0] = world.hash();
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(World, a_non_finite_lattice_returns_to_rest_and_is_counted) {
  auto levels = std::make_shared<LevelSet>();
  levels->levels[2] = support::make_random_level();
  // A spring whose stiffness is not a number makes every node of the step not a number.
  levels->levels[2].springs.stiffness[0] = std::numeric_limits<float>::quiet_NaN();
  World world({});
  const CharacterId id = world.add({levels, LevelIndex::low, {}});
  world.set_pose(id, rigid_pose({Quat::Identity(), {0, 0, 0.1}}));
  EXPECT_EQ(world.step().lattices_reset, 1u);
  for (const Vec3f& d : world.state(id).displacement) EXPECT_TRUE(d.isZero(0));
}

// All runs last 1/3 s. The truth has steps of 1/480 s; four substeps of a tick of 1/30 s must have less than half of
// the squared error of one. The 100 iterations let each step converge, so that only the length of the steps differs.
TEST(World, substeps_come_closer_to_small_steps) {
  const auto levels = make_levels();
  const auto run = [&](double tick_s, int substeps, int ticks) {
    WorldDef def;
    def.tick_s = tick_s;
    def.substep_count = substeps;
    def.iterations = 100;
    World world(def);
    const CharacterId id = world.add({levels, LevelIndex::low, {}});
    for (int tick = 1; tick <= ticks; ++tick) {
      world.set_pose(id, rigid_pose({Quat::Identity(), {0.3 * tick / ticks, 0, 0}}));
      world.step();
    }
    return world.state(id).displacement;
  };
  const auto truth = run(1.0 / 480, 1, 160);
  const auto error = [&](const std::vector<Vec3f>& run_) {
    double sum = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) sum += static_cast<double>((run_[i] - truth[i]).squaredNorm());
    return sum;
  };
  EXPECT_LT(error(run(1.0 / 30, 4, 10)), 0.5 * error(run(1.0 / 30, 1, 10)));
}

// Some of these lattices never come to rest by themselves: their springs are a hundred times as stiff as those of other
// tests (2 N/m), their nodes start at random places, and ticks of 0.1 s are long. World must end such a cycle
// kSettleAfter_s after the bones have come to rest; without this, hair would twitch and its character would never
// sleep.
TEST(World, hair_comes_to_rest_where_linearised_steps_alone_would_go_in_a_cycle) {
  auto levels = std::make_shared<LevelSet>();
  levels->levels[0] = support::make_random_level(
      {.nodes_per_axis = 4, .spring_count = 200, .attachment_count = 30, .spring_stiffness = 200});
  WorldDef def;
  def.tick_s = 0.1;
  World world(def);
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  const auto any = [&] { return Vec3f(normal(random), normal(random), normal(random)); };
  std::vector<CharacterId> ids;
  for (int i = 0; i < 300; ++i) {
    const RigidTransform body = support::turned(0.4 * normal(random), any().cast<double>(), {0, 1.5, 0});
    ids.push_back(world.add({levels, LevelIndex::high, rigid_pose(body)}));
  }
  world.step();
  const std::vector<Vec3f> still(levels->levels[0].rest.size(), Vec3f::Zero());
  for (const CharacterId id : ids) {
    std::vector<Vec3f> thrown = still;
    for (Vec3f& d : thrown) d = 0.1f * any();
    ASSERT_TRUE(world.set_state(id, thrown, still));
  }
  std::size_t moving = 0;
  // Ten ticks are a second. Half a second before settling begins, some lattices must still be in a cycle.
  for (int tick = 1; tick < 10 * (kSettleAfter_s - 0.5); ++tick) world.step();
  for (const CharacterId id : ids) moving += world.state(id).speed_max_m_per_s > 0.02f;
  EXPECT_GT(moving, 0u) << "this test needs lattices in a cycle";
  // Within 20 s more, settling and then sleep (kSleepAfter_s) must have come to all.
  for (int tick = 0; tick < 10 * 20; ++tick) world.step();
  for (const CharacterId id : ids) EXPECT_TRUE(world.lattice(id).asleep);
}

// The undamped hair has neither viscosity nor drag. Only the error of a time step damps its oscillation, and steps of
// 1/240 s are too short for that. Settling must end the oscillation where damped hair rests.
TEST(World, hair_that_swings_undamped_comes_to_rest_where_damped_hair_does) {
  auto damped = std::make_shared<LevelSet>(), undamped = std::make_shared<LevelSet>();
  damped->levels[0] =
      support::make_random_level({.spring_count = 0, .attachment_count = 0, .drag = false, .contacts = false});
  undamped->levels[0] = damped->levels[0];
  std::ranges::fill(undamped->levels[0].ether_damping, 0.0f);
  WorldDef def;
  def.tick_s = 1.0 / 240;
  World world(def);
  const Pose tilted = rigid_pose(support::turned(0.4, {0, 0, 1}, {0, 1.5, 0}));
  const CharacterId at_rest = world.add({damped, LevelIndex::high, tilted});
  const CharacterId id = world.add({undamped, LevelIndex::high, tilted});
  const auto pass = [&](double time_s) {
    for (int tick = 0; tick < 240 * time_s; ++tick) world.step();
  };
  pass(kSettleAfter_s - 0.5);
  EXPECT_GT(world.state(id).speed_max_m_per_s, 0.1f) << "this test needs a lattice that swings";
  // Settling begins after 0.5 s and halves velocities every 1/15 s, so 4 s are ample; the character then sleeps after
  // kSleepAfter_s.
  pass(0.5 + 4 + kSleepAfter_s);
  ASSERT_TRUE(world.lattice(id).asleep);
  for (std::size_t i = 0; i < world.state(id).displacement.size(); ++i)
    EXPECT_NEAR((world.state(id).displacement[i] - world.state(at_rest).displacement[i]).norm(), 0, 1e-3);
}

// Viscosity lets this hair come home in 20 s, as friction on a shoulder can. It must not keep its character awake: it
// sticks 4 s after settling begins (kStickAfter_s in character.cpp), has stopped 4 s later, and sleeps.
TEST(World, hair_that_creeps_for_long_sticks_and_sleeps) {
  auto levels = std::make_shared<LevelSet>();
  Level& level = levels->levels[0];
  level = support::make_random_level({.spring_count = 0, .attachment_count = 0, .drag = false, .contacts = false});
  for (std::size_t i = 0; i < level.ether_damping.size(); ++i) level.ether_damping[i] = 20 * level.ether_stiffness[i];
  WorldDef def;
  World world(def);
  const CharacterId id = world.add({levels, LevelIndex::high, {}});
  world.step();
  const std::vector<Vec3f> away(level.rest.size(), {0, 0, 0.1f}), still(level.rest.size(), Vec3f::Zero());
  ASSERT_TRUE(world.set_state(id, away, still));
  const auto pass = [&](double time_s) {
    for (double t_s = 0; t_s < time_s; t_s += def.tick_s) world.step();
  };
  pass(kSettleAfter_s + 4);
  EXPECT_GT(world.state(id).speed_max_m_per_s, 1.5e-3f) << "this test needs hair that creeps";
  pass(4 + kSleepAfter_s);
  EXPECT_TRUE(world.lattice(id).asleep);
}

TEST(World, a_still_character_sleeps_and_wakes_by_motion_wind_and_change_of_level_or_material) {
  const auto levels = make_levels();
  World world({});
  const Pose tilted = rigid_pose(support::turned(0.6, {0, 0, 1}, {0, 1.5, 0}));
  const CharacterId id = world.add({levels, LevelIndex::low, tilted});
  // Returns the number of ticks until the character sleeps, or -1 when it is awake for 30 s of 30 ticks.
  const auto until_asleep = [&] {
    for (int tick = 0; tick < 30 * 30; ++tick) {
      if (world.step().asleep == 1) return tick;
    }
    return -1;
  };
  // A tick lasts 1/30 s. One tick less is left for the rounding of the sum of ticks.
  EXPECT_GE(until_asleep(), static_cast<int>(kSleepAfter_s * 30) - 1);
  EXPECT_TRUE(world.lattice(id).asleep);
  const LatticeState asleep = world.state(id);
  const std::uint64_t hash = world.hash();
  for (int tick = 0; tick < 100; ++tick) world.step();
  EXPECT_EQ(world.state(id).displacement, asleep.displacement);
  EXPECT_EQ(world.hash(), hash);

  Pose nudged = tilted;
  // A centimetre is far more than kStillShift_m, below which a bone counts as still.
  nudged[Bone::left_shoulder].position.y() += 0.01;
  world.set_pose(id, nudged);
  EXPECT_EQ(world.step().asleep, 0u);
  EXPECT_GE(until_asleep(), 0);
  world.set_environment({.wind = WindField({.mean_m_per_s = {1, 0, 0}})});
  EXPECT_EQ(until_asleep(), -1);
  world.set_environment({});
  EXPECT_GE(until_asleep(), 0);
  world.set_level(id, LevelIndex::medium);
  EXPECT_EQ(world.step().asleep, 0u);
  EXPECT_GE(until_asleep(), 0);
  world.set_material(id, {.gel_per_s2 = 100});
  EXPECT_EQ(world.step().asleep, 0u);
  EXPECT_GE(until_asleep(), 0);
}

// Sleep sets all velocities to zero. Hair must be so slow by then that nobody sees it stop.
TEST(World, sleep_does_not_move_hair) {
  const auto levels = make_levels();
  World world({});
  const CharacterId id = world.add({levels, LevelIndex::high, rigid_pose(support::turned(1.2, {1, 0, 0}))});
  std::vector<Vec3f> before;
  for (int tick = 0; tick < 30 * 30 && !world.lattice(id).asleep; ++tick) {
    const auto d = world.lattice(id).displacement;
    before.assign(d.begin(), d.end());
    world.step();
  }
  ASSERT_TRUE(world.lattice(id).asleep);
  for (std::size_t i = 0; i < before.size(); ++i) {
    // A node that counts as still has at most 1 mm/s (kStillSpeed_m_per_s in character.cpp), that is 0.03 mm in a tick.
    EXPECT_LT((world.lattice(id).displacement[i] - before[i]).norm(), 1e-4f);
  }
}

TEST(World, the_rigid_level_is_eased_into) {
  const auto levels = make_levels();
  World world({});
  const CharacterId id = world.add({levels, LevelIndex::low, {}});
  world.set_pose(id, rigid_pose({Quat::Identity(), {0.2, 0, 0}}));
  for (int tick = 0; tick < 4; ++tick) world.step();
  const auto largest = [&] {
    float most = 0;
    for (const Vec3f& d : world.lattice(id).displacement) most = std::max(most, d.norm());
    return most;
  };
  const float start = largest();
  // The head has jumped by 20 cm in one tick, so there must be hair to ease.
  ASSERT_GT(start, 0.02f);
  ASSERT_TRUE(world.set_level(id, LevelIndex::rigid));
  float last = start;
  int ticks = 0;
  for (; world.lattice(id).level != LevelIndex::rigid; ++ticks) {
    world.step();
    EXPECT_LE(largest(), last);
    // A single tick takes less than a quarter of the way, so hair does not jump.
    EXPECT_GT(largest(), last - 0.25f * start);
    last = largest();
  }
  // The easing lasts kRigidEase_s = 0.3 s, that is 9 ticks of 1/30 s.
  EXPECT_EQ(ticks, 9);
}

// The head jumps by 5 mm, so that its hair comes to rest before the easing ends, and is rigid at the request that
// follows.
TEST(World, rigid_may_be_requested_at_each_tick_of_the_easing) {
  const auto levels = make_levels();
  World world({});
  const CharacterId id = world.add({levels, LevelIndex::low, {}});
  world.set_pose(id, rigid_pose({Quat::Identity(), {0.005, 0, 0}}));
  for (int tick = 0; tick < 4; ++tick) world.step();
  int ticks = 0;
  for (; world.lattice(id).level != LevelIndex::rigid && ticks < 20; ++ticks) {
    ASSERT_TRUE(world.set_level(id, LevelIndex::rigid));
    world.step();
  }
  EXPECT_GT(ticks, 1);
  EXPECT_LE(ticks, 9);
  // The character goes on as any other.
  ASSERT_TRUE(world.set_level(id, LevelIndex::low));
  world.step();
  EXPECT_EQ(world.lattice(id).level, LevelIndex::low);
}

// Three of the nine ticks of easing have passed. Hair must go on from where it is, at rest relative to the head; a
// start in the design would be a jump.
TEST(World, level_requested_while_easing_out_continues_from_the_current_hair) {
  const auto levels = make_levels();
  World world({});
  const CharacterId id = world.add({levels, LevelIndex::low, {}});
  world.set_pose(id, rigid_pose({Quat::Identity(), {0.2, 0, 0}}));
  for (int tick = 0; tick < 4; ++tick) world.step();
  world.set_level(id, LevelIndex::rigid);
  for (int tick = 0; tick < 3; ++tick) world.step();
  const std::vector<Vec3f> before = world.state(id).displacement;
  ASSERT_TRUE(world.set_level(id, LevelIndex::low));
  EXPECT_EQ(world.state(id).displacement, before);
  for (const Vec3f& v : world.state(id).velocity) EXPECT_LT(v.norm(), 1e-6f);
}

// A new material changes the forces of the next steps. A jump of the hair itself would be seen.
TEST(World, a_change_of_material_moves_nothing_at_once) {
  const auto levels = make_levels();
  World world({});
  const CharacterId id = world.add({levels, LevelIndex::high, {}});
  for (int tick = 1; tick < 20; ++tick) {
    world.set_pose(id, shaken(2, tick));
    world.step();
  }
  const LatticeState before = world.state(id);
  world.set_material(id, {.stiffness = 20, .density = 2, .gel_per_s2 = 300});
  EXPECT_EQ(world.state(id).displacement, before.displacement);
  EXPECT_EQ(world.state(id).velocity, before.velocity);
}

TEST(WorldDeathTest, a_pose_that_is_not_finite_stops_the_program) {
  World world({});
  const CharacterId id = world.add({});
  Pose pose;
  pose[Bone::neck].position.x() = std::numeric_limits<double>::infinity();
  EXPECT_DEATH(world.set_pose(id, pose), "assertion failed: is_valid\\(pose\\)");
}

TEST(WorldDeathTest, the_lattice_of_a_removed_character_stops_the_program) {
  World world({});
  const CharacterId id = world.add({});
  world.remove(id);
  EXPECT_DEATH((void)world.lattice(id), "assertion failed: slot");
}

TEST(WorldDeathTest, a_call_while_a_step_runs_stops_the_program) {
  World* stepped = nullptr;
  WorldDef def;
  def.parallel_for = [&](std::size_t, const std::function<void(std::size_t)>&) { stepped->remove({}); };
  World world(def);
  stepped = &world;
  EXPECT_DEATH(world.step(), "assertion failed: !impl_->is_stepping");
}

// A random run of poses (from jitter of 0.1 mm to jumps of 10 m), levels, materials, teleports and wind. No node may
// leave the bound of its level, and no lattice may become not finite. When all of it ends, hair must return to its
// design within 30 s.
TEST(World, nothing_makes_a_lattice_run_away_and_everything_comes_home) {
  auto levels = std::make_shared<LevelSet>(*make_levels());
  // The bound is 0.6 m, and the comparison below leaves 1e-4 of it for the rounding of floats.
  for (Level& level : levels->levels) level.displacement_max_m = 0.6f;
  std::mt19937 random(20041);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<>(low, high)(random); };
  for (const double tick_s : {1.0 / 30, 1.0 / 90}) {
    WorldDef def;
    def.tick_s = tick_s;
    World world(def);
    const CharacterId id = world.add({levels, LevelIndex::high, {}});
    Pose pose;
    for (int step = 0; step < 6000; ++step) {
      const double reach = std::pow(10, uniform(-4, 1)), angle = std::pow(10, uniform(-4, 0.5));
      const RigidTransform jolt =
          support::turned(angle, support::random_vec(random, 1).cast<double>() + Vec3(0, 1e-3, 0),
                          reach * support::random_vec(random, 1).cast<double>());
      for (RigidTransform& bone : pose.bones) bone = bone * jolt;
      if (step % 7 == 0) pose[Bone::left_shoulder].position += 0.1 * support::random_vec(random, 1).cast<double>();
      // The random walk starts again from one place, so that it does not leave the range in which floats are fine.
      if (step % 50 == 0) pose = rounded_to_wire(rigid_pose({pose.head().rotation.normalized(), {0, 1, 0}}));
      for (RigidTransform& bone : pose.bones) bone.rotation.normalize();
      world.set_pose(id, pose, uniform(0, 1) < 0.02);
      if (uniform(0, 1) < 0.1) world.set_level(id, static_cast<LevelIndex>(random() % kLevelCount));
      if (uniform(0, 1) < 0.05) {
        const auto factor = [&] { return static_cast<float>(std::pow(10, uniform(-1, 1))); };
        world.set_material(id, {factor(), factor(), factor(), factor(), factor(), 100 * factor()});
      }
      if (uniform(0, 1) < 0.02) {
        const Vec3 wind = 20 * support::random_vec(random, 1).cast<double>();
        world.set_environment({.wind = WindField({.mean_m_per_s = wind, .turbulence_rms_m_per_s = 5})});
      }
      ASSERT_EQ(world.step().lattices_reset, 0u) << "step " << step;
      for (const Vec3f& d : world.lattice(id).displacement) ASSERT_LE(d.norm(), 0.6f * 1.0001f) << "step " << step;
    }
    world.set_environment({});
    world.set_material(id, {});
    for (int step = 0; step * tick_s < 30; ++step) {
      world.set_pose(id, rigid_pose({Quat::Identity(), {0, 1, 0}}));
      world.step();
    }
    for (const Vec3f& d : world.lattice(id).displacement) EXPECT_LT(d.norm(), 1e-3f);
  }
}

}  // namespace
}  // namespace hairnet
