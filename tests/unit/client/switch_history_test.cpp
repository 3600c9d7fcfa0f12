#include "client/viewer/sources/switch_history.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "client/link/switch_blend.hpp"

namespace hairnet::viewer {
namespace {

constexpr std::int64_t kMs = 1'000'000;

// Stands for the deformation: every level shows another part of the same motion.
std::vector<Vec3f> points_of(LevelIndex level, std::span<const Vec3f> displacement) {
  std::vector<Vec3f> points(4, Vec3f::Constant(static_cast<float>(level)));
  for (const Vec3f& d : displacement) points[0] += d;
  return points;
}

TEST(SwitchHistory, a_moment_drawn_later_is_what_a_display_would_have_shown) {
  std::mt19937 random(7);
  SwitchHistory trail;
  link::SwitchBlend display;
  std::size_t blended = 0, plain = 0;
  LevelIndex level = LevelIndex::high;
  for (std::int64_t now = 0; now < 30'000 * kMs; now += 8 * kMs) {
    // Now and then switches follow each other faster than they fade.
    const std::int64_t wait_ms = (now / (2'000 * kMs)) % 2 ? 120 : 900;
    if (now % (wait_ms * kMs) < 8 * kMs) level = static_cast<LevelIndex>(random() % 3);
    const auto swing = static_cast<float>(std::sin(1e-9 * static_cast<double>(now)));
    const std::vector<Vec3f> displacement(3, Vec3f(swing, 0, 1));
    const link::Playout::Sample sample{true, {}, level, displacement, now, {}};
    trail.note(sample);
    std::vector<Vec3f> shown = points_of(level, displacement);
    display.apply(level, now, false, shown);

    const Moment moment = trail.moment({});
    link::SwitchBlend blend;
    std::vector<Vec3f> drawn;
    for (const Shape& shape : moment.trail) {
      drawn = points_of(shape.level, shape.displacement);
      blend.apply(shape.level, shape.time_ns, false, drawn);
    }
    drawn = points_of(moment.shape.level, moment.shape.displacement);
    blend.apply(moment.shape.level, moment.shape.time_ns, false, drawn);
    for (std::size_t i = 0; i < shown.size(); ++i) ASSERT_LT((drawn[i] - shown[i]).norm(), 1e-5f) << now / kMs;
    ++(moment.trail.empty() ? plain : blended);
  }
  EXPECT_GT(blended, 500u);
  EXPECT_GT(plain, 500u);
}

TEST(SwitchHistory, keeps_little_however_often_the_level_switches) {
  SwitchHistory trail;
  for (int i = 0; i < 1000; ++i) {
    trail.note({true, {}, i % 2 ? LevelIndex::low : LevelIndex::high, {}, i * kMs, {}});
    EXPECT_LE(trail.moment({}).trail.size(), 64u);
  }
}

}  // namespace
}  // namespace hairnet::viewer
