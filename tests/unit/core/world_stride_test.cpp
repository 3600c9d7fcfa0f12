#include <gtest/gtest.h>

#include <array>
#include <random>
#include <vector>

#include "core/levels/level_map.hpp"
#include "core/world/world.hpp"
#include "tests/support/case_name.hpp"
#include "tests/support/levels.hpp"

namespace hairnet {
namespace {

// Makes four levels of random springs; the last one has ether alone. Tests switch off drag or contact where these would
// act on hair.
std::shared_ptr<const LevelSet> make_levels(bool drag = true, bool contacts = true) {
  auto levels = std::make_shared<LevelSet>();
  for (int i = 0; i < 4; ++i) {
    const bool is_ether = i == 3;
    levels->levels[static_cast<std::size_t>(i)] = support::make_random_level({.nodes_per_axis = 6 - i,
                                                                              .spring_count = is_ether ? 0 : 60,
                                                                              .attachment_count = is_ether ? 0 : 10,
                                                                              .drag = drag,
                                                                              .contacts = contacts});
  }
  const std::vector<Vec3f>& points = levels->levels[0].rest;
  make_level_maps(*levels, points, std::vector<float>(points.size(), 1.0f));
  return levels;
}

// Returns the pose of a head that turns and shifts without a pause; `by` scales the motion, and each character is at
// another time of it.
Pose swaying(std::uint32_t character, int tick, double by = 1) {
  const double t = tick / 30.0 + character;
  return rigid_pose(support::turned(by * 0.3 * std::sin(4 * t), {0.2, 1, 0.1}, {by * 0.1 * std::sin(3 * t), 1.5, 0}));
}

std::vector<Vec3f> displacement(const World& world, CharacterId id) {
  const auto nodes = world.lattice(id).displacement;
  return {nodes.begin(), nodes.end()};
}

// Runs each case with a stride of 1, 2 and 4 ticks, the only ones that World takes.
class Strides : public testing::TestWithParam<support::Named<int>> {
 protected:
  static int stride() { return GetParam().value; }
};

// With a stride of n a character is stepped in every n-th tick, to save time for characters that are far away.
TEST_P(Strides, a_character_steps_in_its_turns_and_stays_as_it_was_between) {
  World world({});
  const CharacterId id = world.add({make_levels(), LevelIndex::low, swaying(0, 0)});
  world.set_stride(id, stride());
  for (int tick = 1; tick <= 24; ++tick) {
    const std::vector<Vec3f> before = displacement(world, id);
    const Vec3 place = world.lattice(id).pose->head().position;
    world.set_pose(id, swaying(0, tick));
    const StepReport report = world.step();
    const bool is_due = (tick - 1) % stride() == 0;
    EXPECT_EQ(world.lattice(id).stepped, is_due) << "tick " << tick;
    EXPECT_EQ(report.stepped, is_due ? 1u : 0u);
    EXPECT_EQ(report.waiting, is_due ? 0u : 1u);
    if (is_due) {
      EXPECT_EQ(world.lattice(id).pose->head().position, swaying(0, tick).head().position);
      EXPECT_NE(displacement(world, id), before);
    } else {
      EXPECT_EQ(world.lattice(id).pose->head().position, place);
      EXPECT_EQ(displacement(world, id), before);
    }
  }
}

TEST_P(Strides, the_turns_of_one_stride_spread_over_the_ticks) {
  World world({});
  const auto levels = make_levels();
  for (int i = 0; i < 8; ++i) world.set_stride(world.add({levels, LevelIndex::low, {}}), stride());
  for (int tick = 0; tick < 8; ++tick) EXPECT_EQ(world.step().stepped, 8u / static_cast<unsigned>(stride()));
}

// The time of rest must be counted in seconds, not in turns, or a character of stride 4 would sleep four times as late.
TEST_P(Strides, a_character_falls_asleep_as_soon_as_at_every_tick) {
  World world({});
  const CharacterId id = world.add({make_levels(), LevelIndex::low, {}});
  world.set_stride(id, stride());
  int ticks = 0;
  while (world.step().asleep == 0 && ticks < 1000) ++ticks;
  EXPECT_GE(ticks, static_cast<int>(kSleepAfter_s * 30) - stride());
  EXPECT_LE(ticks, static_cast<int>(kSleepAfter_s * 30) + 2 * stride());
  EXPECT_TRUE(world.lattice(id).asleep);
  EXPECT_FALSE(world.lattice(id).stepped);
}

TEST_P(Strides, the_rigid_level_is_eased_into_in_the_same_time) {
  World world({});
  const CharacterId id = world.add({make_levels(), LevelIndex::low, {}});
  world.set_stride(id, stride());
  world.set_pose(id, rigid_pose({Quat::Identity(), {0.2, 0, 0}}));
  for (int tick = 0; tick < 4; ++tick) world.step();
  ASSERT_TRUE(world.set_level(id, LevelIndex::rigid));
  int ticks = 0;
  for (; world.lattice(id).level != LevelIndex::rigid && ticks < 100; ++ticks) world.step();
  EXPECT_NEAR(ticks, kRigidEase_s * 30, stride());
}

INSTANTIATE_TEST_SUITE_P(All, Strides,
                         testing::Values(support::Named{"every_tick", 1}, support::Named{"every_second_tick", 2},
                                         support::Named{"every_fourth_tick", 4}),
                         support::CaseName());

// Compares strides of 2 and 4 ticks with a stride of 1. The error is the RMS distance in the turns of the slower
// character, over the RMS motion. The head moves in a gusty wind, so that poses, the length of steps and the time of
// the wind must all be right. It moves little and touches no skin, since springs that stiffen, and contact, depend on
// the length of a step.
TEST(Stride, comes_close_to_what_every_tick_comes_to) {
  WorldDef def;
  def.environment.wind = WindField({.mean_m_per_s = {0.5, 0, 0}, .gust_ratio = 1, .gust_period_s = 1.5});
  for (const LevelIndex level : {LevelIndex::high, LevelIndex::low, LevelIndex::ether}) {
    const auto levels = make_levels(true, false);
    std::array<World, 3> worlds{World(def), World(def), World(def)};
    std::array<CharacterId, 3> ids;
    for (std::size_t w = 0; w < 3; ++w) {
      ids[w] = worlds[w].add({levels, level, swaying(0, 0, 0.5)});
      worlds[w].set_stride(ids[w], 1 << w);
    }
    std::array<double, 3> error{}, motion{};
    for (int tick = 1; tick <= 120; ++tick) {
      for (std::size_t w = 0; w < 3; ++w) {
        worlds[w].set_pose(ids[w], swaying(0, tick, 0.5));
        worlds[w].step();
        // The first second, in which all start from rest, does not count.
        if (tick < 30 || !worlds[w].lattice(ids[w]).stepped) continue;
        const auto truth = displacement(worlds[0], ids[0]), here = displacement(worlds[w], ids[w]);
        for (std::size_t i = 0; i < truth.size(); ++i) {
          error[w] += static_cast<double>((here[i] - truth[i]).squaredNorm());
          motion[w] += static_cast<double>(truth[i].squaredNorm());
        }
      }
    }
    // The limits hold for this gentle motion, and at the turns themselves. Lively motion differs by more
    // (core/README.md, Strides).
    EXPECT_LT(std::sqrt(error[1] / motion[1]), 0.03) << kLevelNames[static_cast<std::size_t>(level)];
    EXPECT_LT(std::sqrt(error[2] / motion[2]), 0.06) << kLevelNames[static_cast<std::size_t>(level)];
  }
}

// In steady translation without drag nothing moves relative to the head, provided that every step has the length of its
// interval. A step that were too short or too long would push all hair; 5e-6 m is left for rounding.
TEST(Stride, loses_no_time_however_it_changes) {
  World world({});
  const CharacterId id = world.add({make_levels(false), LevelIndex::rigid, {}});
  std::mt19937 random(3);
  for (int tick = 0; tick < 400; ++tick) {
    world.set_pose(id, rigid_pose({Quat::Identity(), {0, 0, 0.05 * tick}}));
    if (random() % 3 == 0) world.set_stride(id, 1 << random() % 3);
    world.step();
    if (tick == 20) {
      ASSERT_TRUE(world.set_level(id, LevelIndex::medium));
    }
    for (const Vec3f& d : world.lattice(id).displacement) ASSERT_LT(d.norm(), 5e-6f) << "tick " << tick;
  }
  EXPECT_EQ(world.lattice(id).level, LevelIndex::medium);
}

TEST(Stride, a_character_moves_alike_alone_and_among_others_of_any_stride) {
  const auto levels = make_levels();
  World alone({}), crowded({});
  // A character's slot decides in which ticks its turns are. Both worlds give this one their first slot.
  const CharacterId a = alone.add({levels, LevelIndex::medium, swaying(0, 0)});
  std::vector<CharacterId> ids;
  for (std::uint32_t i = 0; i < 40; ++i) ids.push_back(crowded.add({levels, LevelIndex::medium, swaying(i, 0)}));
  std::mt19937 random(8);
  for (int tick = 1; tick < 40; ++tick) {
    if (tick % 7 == 1) {
      const int stride = 1 << (tick / 7) % 3;
      alone.set_stride(a, stride);
      crowded.set_stride(ids[0], stride);
    }
    for (std::uint32_t i = 1; i < ids.size(); ++i) {
      if (random() % 4 == 0) crowded.set_stride(ids[i], 1 << random() % 3);
      if (random() % 8 == 0) crowded.set_suspended(ids[i], random() % 2 == 0);
    }
    alone.set_pose(a, swaying(0, tick));
    for (std::uint32_t i = 0; i < ids.size(); ++i) crowded.set_pose(ids[i], swaying(i, tick));
    alone.step();
    crowded.step();
    ASSERT_EQ(displacement(alone, a), displacement(crowded, ids[0])) << "tick " << tick;
  }
}

TEST(Stride, a_teleport_between_turns_is_made_in_the_next_one) {
  World world({});
  const CharacterId id = world.add({make_levels(), LevelIndex::low, swaying(0, 0)});
  world.set_stride(id, 4);
  // The character has its turns in the ticks 1, 5 and 9, so the teleport after tick 9 waits until tick 13.
  for (int tick = 1; tick <= 9; ++tick) {
    world.set_pose(id, swaying(0, tick));
    world.step();
  }
  const std::vector<Vec3f> before = displacement(world, id);
  world.set_pose(id, rigid_pose({Quat::Identity(), {0, 1.5, 0.2}}), true);
  for (int tick = 10; tick <= 13; ++tick) {
    world.set_pose(id, rigid_pose({Quat::Identity(), {0, 1.5, 0.2}}));
    EXPECT_EQ(world.step().teleports, tick == 13 ? 1u : 0u);
  }
  EXPECT_TRUE(world.lattice(id).discontinuous);
  EXPECT_EQ(displacement(world, id), before);
}

// A suspended character is not stepped, which saves time while nobody sees it.
TEST(Suspended, a_character_is_not_stepped_and_nothing_of_it_changes) {
  World world({});
  const CharacterId id = world.add({make_levels(), LevelIndex::low, swaying(0, 0)});
  for (int tick = 1; tick < 20; ++tick) {
    world.set_pose(id, swaying(0, tick));
    world.step();
  }
  const std::vector<Vec3f> before = displacement(world, id);
  world.set_suspended(id, true);
  const std::uint64_t hash = world.hash();
  for (int tick = 0; tick < 100; ++tick) {
    const StepReport report = world.step();
    EXPECT_EQ(report.stepped + report.asleep + report.waiting, 0u);
    EXPECT_EQ(report.suspended, 1u);
    EXPECT_FALSE(world.lattice(id).stepped);
  }
  EXPECT_EQ(displacement(world, id), before);
  EXPECT_EQ(world.hash(), hash);
}

// The head has moved on during the suspension. The hair must appear with the head, in the shape that it had.
TEST(Suspended, resumed_it_moves_rigidly_with_the_head_and_continues_in_the_next_tick) {
  for (const int stride : {1, 2, 4}) {
    World world({});
    const CharacterId id = world.add({make_levels(), LevelIndex::low, swaying(0, 0)});
    world.set_stride(id, stride);
    for (int tick = 1; tick < 21; ++tick) {
      world.set_pose(id, swaying(0, tick));
      world.step();
    }
    const std::vector<Vec3f> before = displacement(world, id);
    world.set_suspended(id, true);
    for (int tick = 21; tick < 63; ++tick) {
      world.set_pose(id, swaying(0, tick));
      world.step();
    }
    world.set_suspended(id, false);
    world.step();
    EXPECT_TRUE(world.lattice(id).stepped);
    EXPECT_TRUE(world.lattice(id).discontinuous);
    EXPECT_EQ(displacement(world, id), before);
    EXPECT_EQ(world.lattice(id).pose->head().position, swaying(0, 62).head().position);
    for (int tick = 63; tick < 63 + stride; ++tick) {
      world.set_pose(id, swaying(0, tick));
      world.step();
    }
    EXPECT_FALSE(world.lattice(id).discontinuous);
    EXPECT_NE(displacement(world, id), before);
  }
}

// The head stands still, then moves at 3 m/s while the hair is suspended, then at 0.6 m/s during a second suspension.
// Hair that kept its old world velocity would be jerked when it is resumed. It must stay at rest relative to the head.
TEST(Suspended, released_on_a_moving_head_hair_is_not_jerked) {
  World world({});
  const CharacterId id = world.add({make_levels(false), LevelIndex::medium, {}});
  double z = 0;
  const auto walk = [&](double step_m, int ticks) {
    for (int tick = 0; tick < ticks; ++tick) {
      z += step_m;
      world.set_pose(id, rigid_pose({Quat::Identity(), {0, 0, z}}));
      world.step();
    }
  };
  walk(0, 2);
  world.set_suspended(id, true);
  walk(0.1, 30);
  world.set_suspended(id, false);
  // In the first tick after a suspension the hair only moves along with the head.
  walk(0.1, 1);
  walk(0.1, 10);
  for (const Vec3f& d : world.lattice(id).displacement) EXPECT_LT(d.norm(), 1e-5f);
  world.set_suspended(id, true);
  walk(0.02, 5);
  ASSERT_TRUE(world.set_level(id, LevelIndex::low));
  world.set_suspended(id, false);
  walk(0.02, 10);
  for (const Vec3f& d : world.lattice(id).displacement) EXPECT_LT(d.norm(), 1e-5f);
}

// The run has random poses, levels, strides, teleports and suspensions. No node may leave its bound, and hair must
// return to its design within the 30 s (900 ticks) after the run.
TEST(Stride, nothing_makes_a_lattice_run_away) {
  auto levels = std::make_shared<LevelSet>(*make_levels());
  for (Level& level : levels->levels) level.displacement_max_m = 0.6f;
  std::mt19937 random(77);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<>(low, high)(random); };
  World world({});
  const CharacterId id = world.add({levels, LevelIndex::high, {}});
  Pose pose;
  for (int step = 0; step < 8000; ++step) {
    // Shifts from 0.1 mm to 1 m and turns from 0.1 mrad to 3.2 rad are drawn evenly on a logarithmic scale.
    const double reach = std::pow(10, uniform(-4, 0)), angle = std::pow(10, uniform(-4, 0.5));
    const RigidTransform jolt = support::turned(angle, support::random_vec(random, 1).cast<double>() + Vec3(0, 1e-3, 0),
                                                reach * support::random_vec(random, 1).cast<double>());
    for (RigidTransform& bone : pose.bones) bone = bone * jolt;
    if (step % 50 == 0) pose = rigid_pose({pose.head().rotation.normalized(), {0, 1, 0}});
    for (RigidTransform& bone : pose.bones) bone.rotation.normalize();
    world.set_pose(id, pose, uniform(0, 1) < 0.02);
    if (uniform(0, 1) < 0.1) world.set_level(id, static_cast<LevelIndex>(random() % kLevelCount));
    if (uniform(0, 1) < 0.1) world.set_stride(id, 1 << random() % 3);
    if (uniform(0, 1) < 0.1) world.set_suspended(id, random() % 2 == 0);
    ASSERT_EQ(world.step().lattices_reset, 0u) << "step " << step;
    for (const Vec3f& d : world.lattice(id).displacement) ASSERT_LE(d.norm(), 0.6f * 1.0001f) << "step " << step;
  }
  world.set_suspended(id, false);
  world.set_stride(id, 4);
  world.set_level(id, LevelIndex::high);
  for (int step = 0; step < 900; ++step) {
    world.set_pose(id, rigid_pose({Quat::Identity(), {0, 1, 0}}));
    world.step();
  }
  for (const Vec3f& d : world.lattice(id).displacement) EXPECT_LT(d.norm(), 1e-3f);
}

}  // namespace
}  // namespace hairnet
