#include "client/link/switch_blend.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "client/assets/made/made.hpp"
#include "core/ffd/deform.hpp"
#include "core/levels/build.hpp"
#include "core/world/world.hpp"

namespace hairnet::link {
namespace {

constexpr std::int64_t kTick_ns = 33'333'333;

TEST(SwitchBlend, changes_nothing_while_the_level_stays) {
  SwitchBlend blend;
  for (int tick = 0; tick < 5; ++tick) {
    std::vector<Vec3f> points{{0.1f * static_cast<float>(tick), 0, 0}};
    const std::vector<Vec3f> before = points;
    blend.apply(LevelIndex::low, tick * kTick_ns, false, points);
    EXPECT_EQ(points, before);
  }
}

TEST(SwitchBlend, starts_where_the_hair_was_and_ends_where_it_belongs) {
  SwitchBlend blend;
  std::vector<Vec3f> points{{0, 0, 0}};
  blend.apply(LevelIndex::high, 0, false, points);
  float last = 0;
  for (int tick = 1; tick <= 20; ++tick) {
    points = {{1, 0, 0}};
    blend.apply(LevelIndex::low, tick * kTick_ns, false, points);
    if (tick == 1) {
      EXPECT_EQ(points[0].x(), 0);
    }
    EXPECT_GE(points[0].x(), last);
    last = points[0].x();
  }
  EXPECT_EQ(last, 1);
}

TEST(SwitchBlend, a_teleport_is_shown_as_it_is) {
  SwitchBlend blend;
  std::vector<Vec3f> points{{0, 0, 0}};
  blend.apply(LevelIndex::high, 0, false, points);
  points = {{1, 0, 0}};
  blend.apply(LevelIndex::low, kTick_ns, true, points);
  EXPECT_EQ(points[0].x(), 1);
}

// A tilted head at rest: all levels in turn. They differ by centimetres at some points of the hair.
TEST(SwitchBlend, no_hair_jumps_when_levels_change_at_rest) {
  HairstyleOptions options;
  options.strand_count = 500;
  const Groom groom = *make_hairstyle("long_straight", options);
  const auto levels = build_levels(groom);
  World world({});
  const Pose tilted = rigid_pose({Quat(Eigen::AngleAxisd(0.6, Vec3::UnitZ())), Vec3::Zero()});
  const CharacterId id = world.add({levels, LevelIndex::high, tilted});
  SwitchBlend blend;
  std::vector<Vec3f> last, points(groom.points.size());
  float raw_jump = 0, jump = 0;
  std::vector<Vec3f> last_raw;
  constexpr int kSettled = 300, kHold = 30;
  for (int tick = 0; tick < kSettled + 8 * kHold; ++tick) {
    if (tick >= kSettled && tick % kHold == 0) world.set_level(id, static_cast<LevelIndex>((tick / kHold) % 3));
    world.step();
    const LatticeView lattice = world.lattice(id);
    std::vector<Vec3f> grid(lattice.model->geometry.lattice.node_count());
    expand_displacements(lattice.model->geometry, lattice.displacement, grid);
    Deformer(groom, lattice.model->geometry.lattice, FfdKind::quadratic).deform(grid, points);
    const std::vector<Vec3f> raw = points;
    blend.apply(lattice.level, tick * kTick_ns, false, points);
    if (tick >= kSettled && tick % kHold == 0) {
      for (std::size_t i = 0; i < points.size(); ++i) {
        jump = std::max(jump, (points[i] - last[i]).norm());
        raw_jump = std::max(raw_jump, (raw[i] - last_raw[i]).norm());
      }
    }
    last = points;
    last_raw = raw;
  }
  EXPECT_GT(raw_jump, 0.005f) << "nothing to blend: the case tests nothing";
  std::printf("hair jumps %.2f mm at a switch at most, %.1f mm without the blend\n", 1e3 * double{jump},
              1e3 * double{raw_jump});
  EXPECT_LT(jump, 0.002f);
}

}  // namespace
}  // namespace hairnet::link
