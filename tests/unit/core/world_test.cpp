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

// Levels that differ only in their lattices; their nodes serve as hair points when maps are fitted.
std::shared_ptr<const LevelSet> connected(const std::shared_ptr<LevelSet>& levels) {
  const std::vector<Vec3f>& points = levels->levels[0].rest;
  make_level_maps(*levels, points, std::vector<float>(points.size(), 1.0f));
  return levels;
}

std::shared_ptr<const LevelSet> make_levels() {
  auto levels = std::make_shared<LevelSet>();
  levels->levels[0] = support::make_random_level({.nodes_per_axis = 6, .spring_count = 200, .attachment_count = 30});
  levels->levels[1] = support::make_random_level({.nodes_per_axis = 5});
  levels->levels[2] = support::make_random_level({.nodes_per_axis = 4});
  levels->levels[3] = support::make_random_level({.nodes_per_axis = 4, .spring_count = 0, .attachment_count = 0});
  return connected(levels);
}

Pose shaken(std::uint32_t character, int tick) {
  const double t = tick / 30.0 + character;
  Pose pose = rigid_pose(support::turned(0.6 * std::sin(5 * t), {0.2, 1, 0.1}, {0.2 * std::sin(3 * t), 1.5, 0}));
  return rounded_to_wire(pose);
}

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
  world.set_pose(id, rigid_pose({Quat::Identity(), {0, 0, 0.8}}));
  EXPECT_EQ(world.step().teleports, 0u);
  world.set_pose(id, rigid_pose({Quat::Identity(), {0, 0, 3}}));
  EXPECT_EQ(world.step().teleports, 1u);
  world.set_pose(id, rigid_pose(support::turned(1.5, {0, 1, 0}, {0, 0, 3})));
  EXPECT_EQ(world.step().teleports, 1u);
}

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
  const Vec3f before = mean();  // ether alone: about the same lean everywhere
  ASSERT_GT(before.norm(), 0.05f);
  ASSERT_TRUE(leaning.set_level(leaner, LevelIndex::medium));
  EXPECT_LT((mean() - before).norm(), 0.05f * before.norm());
  EXPECT_FALSE(world.set_level(CharacterId{77, 1}, LevelIndex::low));
  EXPECT_TRUE(world.set_level(id, LevelIndex::rigid));
  EXPECT_TRUE(world.lattice(id).displacement.empty());
}

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
  levels->levels[2].springs.stiffness[0] = std::numeric_limits<float>::quiet_NaN();
  World world({});
  const CharacterId id = world.add({levels, LevelIndex::low, {}});
  world.set_pose(id, rigid_pose({Quat::Identity(), {0, 0, 0.1}}));
  EXPECT_EQ(world.step().lattices_reset, 1u);
  for (const Vec3f& d : world.state(id).displacement) EXPECT_TRUE(d.isZero(0));
}

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

// Stiff springs, thrown at random, at long ticks: some lattices never come to rest by themselves.
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
  for (int tick = 1; tick < 10 * (kSettleAfter_s - 0.5); ++tick) world.step();
  for (const CharacterId id : ids) moving += world.state(id).speed_max_m_per_s > 0.02f;
  EXPECT_GT(moving, 0u) << "this test needs lattices in a cycle";
  for (int tick = 0; tick < 10 * 20; ++tick) world.step();
  for (const CharacterId id : ids) EXPECT_TRUE(world.lattice(id).asleep);
}

// Nothing damps it but the length of the step, which is short.
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
  pass(0.5 + 4 + kSleepAfter_s);
  ASSERT_TRUE(world.lattice(id).asleep);
  for (std::size_t i = 0; i < world.state(id).displacement.size(); ++i)
    EXPECT_NEAR((world.state(id).displacement[i] - world.state(at_rest).displacement[i]).norm(), 0, 1e-3);
}

TEST(World, a_still_character_sleeps_and_wakes_by_motion_wind_and_change_of_level_or_material) {
  const auto levels = make_levels();
  World world({});
  const Pose tilted = rigid_pose(support::turned(0.6, {0, 0, 1}, {0, 1.5, 0}));
  const CharacterId id = world.add({levels, LevelIndex::low, tilted});
  const auto until_asleep = [&] {
    for (int tick = 0; tick < 30 * 30; ++tick) {
      if (world.step().asleep == 1) return tick;
    }
    return -1;
  };
  EXPECT_GE(until_asleep(), static_cast<int>(kSleepAfter_s * 30) - 1);
  EXPECT_TRUE(world.lattice(id).asleep);
  const LatticeState asleep = world.state(id);
  const std::uint64_t hash = world.hash();
  for (int tick = 0; tick < 100; ++tick) world.step();
  EXPECT_EQ(world.state(id).displacement, asleep.displacement);
  EXPECT_EQ(world.hash(), hash);

  Pose nudged = tilted;
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
  ASSERT_GT(start, 0.02f);
  ASSERT_TRUE(world.set_level(id, LevelIndex::rigid));
  float last = start;
  int ticks = 0;
  for (; world.lattice(id).level != LevelIndex::rigid; ++ticks) {
    world.step();
    EXPECT_LE(largest(), last);
    EXPECT_GT(largest(), last - 0.25f * start);  // no jump
    last = largest();
  }
  EXPECT_EQ(ticks, 9);
}

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

// Random poses (from shaking at the tick rate to jumps), levels, materials and wind. Nodes stay within the bound and
// always return to rest.
TEST(World, nothing_makes_a_lattice_run_away_and_everything_comes_home) {
  auto levels = std::make_shared<LevelSet>(*make_levels());
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
